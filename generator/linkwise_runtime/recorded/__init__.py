"""What torch computes while it differentiates, recorded operation by operation."""
