"""Readers of URDF files."""
