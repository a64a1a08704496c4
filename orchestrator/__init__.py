"""Starts, watches and ends the processes of a run, and is what people call: `orchestrator train CONFIG`."""
