"""What report, comparison, batch page and recording draw with."""
