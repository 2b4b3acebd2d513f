"""Inverse dynamics of one arm, for motions in buffers of doubles (array.array, NumPy arrays)."""

from arm_control._arm import JOINTS, inverse_dynamics

__all__ = ["JOINTS", "inverse_dynamics"]
