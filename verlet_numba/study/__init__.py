"""What is done with finished trajectories."""
