"""What works on finished runs, or without one: batch, compare, imu, live."""
