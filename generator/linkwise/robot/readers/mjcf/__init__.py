"""Readers of MJCF files, which MuJoCo's own compiler reads first."""
