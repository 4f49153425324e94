"""Feet on the floor, and what a walk or a run is measured by."""
