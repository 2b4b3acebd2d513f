"""Poses and motion of a robot's named frames, and the wrenches that joints bear, by the rule's arrays."""
