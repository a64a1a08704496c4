"""The state of a run, for terminals and monitoring systems."""
