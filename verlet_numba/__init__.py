"""Position-based (Verlet) simulation of ropes, cloth and rigid bodies, in batches, from the command line."""

__version__ = "0.1.0"
