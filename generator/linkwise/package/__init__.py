"""A generated package seen from outside."""
