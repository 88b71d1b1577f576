"""`python cli.py ...` is `verlet-numba ...`."""

from verlet_numba.cli import main

main()
