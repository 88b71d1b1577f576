"""Formulas: scalars in, scalars out, one family a file."""
