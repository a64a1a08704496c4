"""An experiment's results as Markdown and plots."""
