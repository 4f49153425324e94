"""From paths to a take: find the adapter, load, check left and right, put on the video's clock."""
