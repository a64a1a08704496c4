"""Fits a lifter on a table of `orchestrator lifter fit`; needs the extra `lifter`, which has torch."""
