"""Says its last words and crashes, each time."""
