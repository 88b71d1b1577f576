"""Every structure-of-arrays buffer that kernels work on, and the one gate that makes them, a file for each part of the method.

Particles of the inner numbering: bodies of equal topology form a group of K copies, numbered copy-minor in blocks of
B copies, so that particle p of copy k has the index first + (k // B) P B + p B + k % B. The same particle of
neighbouring copies lies side by side: bodies are vector lanes. Blocks are padded with ghosts, particles of inverse
mass 0 that no constraint moves.

The comment behind a field gives its shape, kind and unit; a test holds it true for built scenes. n particles of the
inner numbering, N particles of the file; real: the precision of the run; a field that may be None belongs to what a
scene may not call for.
"""
