"""What is computed from joints over time: signals, angles, cycles, checks, exchanged limbs."""
