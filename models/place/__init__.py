"""Where the person is before the camera: the pelvis's path from 2D keypoints, the lifted body and the focal length."""
