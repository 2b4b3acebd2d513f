"""Where the named frames of a robot are and how they move, on the arrays of the rule."""
