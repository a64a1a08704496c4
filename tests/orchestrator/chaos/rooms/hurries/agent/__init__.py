"""As `remembers`, but for steps that take no time: all of them would be flown before the first fault is over."""
