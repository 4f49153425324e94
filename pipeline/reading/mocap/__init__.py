"""Motion capture files as clips of joints, metres, in a world with +Z up."""
