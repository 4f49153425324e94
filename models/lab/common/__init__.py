"""What the lab's commands share: configuration files, training, test beds."""
