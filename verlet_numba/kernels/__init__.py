"""Loops over buffers, one phase of the substep a file."""
