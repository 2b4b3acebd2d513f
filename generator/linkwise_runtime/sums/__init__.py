"""Sums over the links, and what follows from them: matrices, forward dynamics, energies and power."""
