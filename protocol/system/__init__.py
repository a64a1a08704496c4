"""A process and its operating system: signals, streams, logs, locks, descriptors, priorities, and exit codes."""
