"""Poses and motion of a robot's named frames, on the arrays of the rule."""
