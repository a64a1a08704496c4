"""Stands in for the agent: flies steps that follow from each other, and goes on from its last checkpoint."""
