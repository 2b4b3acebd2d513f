"""Built-in robots, as data."""
