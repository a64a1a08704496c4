"""What the operating system gives a process and refuses it: its start, locks, descriptors, home, streams and end."""
