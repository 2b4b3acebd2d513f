"""Link energies in SymPy, and the systems made of them."""
