"""Closed loops of a robot: where they close, and which coordinates then move all others."""
