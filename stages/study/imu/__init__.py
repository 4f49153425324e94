"""`pcnet3d imu`."""
