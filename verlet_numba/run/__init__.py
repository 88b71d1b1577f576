"""Chunks of frames, the trajectory file."""
