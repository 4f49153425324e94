"""Motion capture: clips, their split, converters."""
