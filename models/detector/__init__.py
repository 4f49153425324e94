"""2D detectors: networks, crops, tracking, whole videos."""
