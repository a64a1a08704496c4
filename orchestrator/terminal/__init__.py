"""What passes between the commands and a person: consoles, what is printed, and how a command ends."""
