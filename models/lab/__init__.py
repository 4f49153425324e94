"""What makes and judges the models: training, its material, evaluation, fitted constants."""
