"""`pcnet3d inspect`: what is wrong with poses, keypoints, or a video."""
