"""Targets for an experiment's figures."""
