"""The method: coefficients of rigid links by rule, of other energies by Euler–Lagrange."""
