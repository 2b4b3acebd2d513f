"""Causes of a robot's motion, source by source, and the motion over time."""
