"""What is computed from joints over time: filters, angles, checks, exchanged limbs. Nothing here is fitted on data."""
