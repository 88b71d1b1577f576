"""`python -m verlet_numba ...` is `verlet-numba ...`."""

from verlet_numba.cli.main import main

if __name__ == "__main__":      # worker processes import this module
    main()
