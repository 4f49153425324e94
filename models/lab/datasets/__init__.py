"""Data sets whose files only a laboratory has, turned into files that pcnet3d reads."""
