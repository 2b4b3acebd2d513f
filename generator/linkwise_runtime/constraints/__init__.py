"""What ties, couplings and contacts leave of a robot's motion, on the arrays of the rule."""
