"""Starts, watches and reports a run: the command line and everything behind it."""
