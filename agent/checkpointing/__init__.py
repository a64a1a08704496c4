"""What a training puts on disk so that it may be killed anywhere and goes on with the same result."""
