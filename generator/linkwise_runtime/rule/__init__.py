"""Vectorised rule of rigid links: joints and links in motion, on arrays of any number of samples."""
