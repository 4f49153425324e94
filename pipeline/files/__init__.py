"""Readers and writers of files that have nothing to do with one estimator."""
