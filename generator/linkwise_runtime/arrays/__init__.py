"""Back ends that compute with arrays: NumPy, torch."""
