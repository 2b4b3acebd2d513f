"""Term counts, operation counts and the cost-reduction curve."""
