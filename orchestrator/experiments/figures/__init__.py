"""The figures of an experiment, computed from its table of frames: pure functions."""
