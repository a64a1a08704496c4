"""Stands in for the agent: asks the workers for scenes and learns nothing."""
