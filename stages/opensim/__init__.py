"""A finished run in OpenSim: a model scaled to the person, and its inverse kinematics."""
