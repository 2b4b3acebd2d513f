"""Certainty of answers: what the numbers of a robot's bodies rest on, and what their errors do."""
