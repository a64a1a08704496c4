"""The terminal: consoles, output on stdout, and exit codes with their messages."""
