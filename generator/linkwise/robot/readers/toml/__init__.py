"""Readers of robots in TOML, schema 1."""
