"""Whether stated errors hold, and what makes them hold: one procedure for every statement."""
