"""The synthetic walker: motion, cameras, and the files that a user would have of it."""
