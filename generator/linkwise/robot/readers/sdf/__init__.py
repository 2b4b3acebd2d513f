"""Readers of SDFormat files."""
