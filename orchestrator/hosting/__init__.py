"""Workers of other machines: the host that they join, and the runs that use them."""
