"""Goes on from its last checkpoint, and forgets to cut its journal back to it."""
