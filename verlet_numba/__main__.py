"""`python -m verlet_numba ...` is `verlet-numba ...`."""

from verlet_numba.cli import main

main()
