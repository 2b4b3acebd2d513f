"""The expression graph: lowering from SymPy, derivatives, the rigid-link rule, operation counts."""
