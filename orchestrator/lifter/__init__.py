"""What a learned lifter is fitted on: views of train identities, far wider than what it is tested on."""
