"""Ties, couplings and contacts of a robot and its motion under them, on the arrays of the rule."""
