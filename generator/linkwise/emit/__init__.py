"""Text of generated packages."""
