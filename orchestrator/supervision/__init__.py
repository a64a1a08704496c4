"""Keeping the processes of a run alive: starting, probing, restarting and stopping them."""
