"""One file an effect: what it does to the particles, nothing where it is None."""
