"""Variances of shares by uncertain motion, as compiled code answers them."""

from ..structure import Structure

SHARES = ("c2", "c1", "gravity", "torque")
PRODUCTS = ("acceleration", "velocity", "power")
"""Shares c2 times qdd, c1 times qd, and torques times the velocities of their joints."""
VARIANCES = (*SHARES, *PRODUCTS, *(f"joint_{name}" for name in (*SHARES, *PRODUCTS)))
"""Variances by name, in the order of the C function: packed as in `Layout`, where accelerations lie as
velocities do, and of sums over links."""
WITH_MOTION = "joint_motion"
"""Covariances of joints' torques with q, qd and qdd of the same joints, (3 n)."""


def variance_sizes(structure: Structure) -> dict[str, int]:
    """Return the number of entries of each variance of one sample, and of `WITH_MOTION`, by name."""
    c2, c1, g, tau = structure.sizes[:4]
    n = structure.n
    entries = (c2, c1, g, tau, c1, c1, tau, n * n, n * n, n, n, n * n, n * n, n, 3 * n)
    return dict(zip((*VARIANCES, WITH_MOTION), entries, strict=True))
