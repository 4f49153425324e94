"""From paths to a take: find the adapter, load, judge what is in it, put on the video's clock."""
