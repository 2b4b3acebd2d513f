"""References that packages are compared with: nothing here is shared with what writes them."""
