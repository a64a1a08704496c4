"""Pictures as they travel between machines: packed by JPEG or without loss."""
