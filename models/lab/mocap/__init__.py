"""Motion capture as training and test material: converters, the split by subject."""
