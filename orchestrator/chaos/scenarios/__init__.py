"""The faults that a rehearsal plays: one scenario a file, and what they have in common."""
