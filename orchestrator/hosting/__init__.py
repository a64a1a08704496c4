"""Workers on other machines: the host that they register with, and the runs that join it."""
