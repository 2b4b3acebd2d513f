"""The expression graph, which knows nothing of mechanics."""
