"""Certainty: what joint torques determine, and what the rest may be."""
