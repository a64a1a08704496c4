"""Experiments: many views through the workers, a table of what came of them, and the figures, plots and pages of it."""
