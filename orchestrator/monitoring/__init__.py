"""What people and monitoring systems are shown of a run."""
