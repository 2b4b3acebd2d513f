"""Certainty: what joint torques determine, what the rest may be, and what errors of bodies do to shares."""
