"""What an experiment's figures are held to."""
