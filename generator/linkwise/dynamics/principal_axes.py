"""Principal axes of a link, by Jacobi's rotations.

Square roots and products alone, in a fixed order: the digits, which end up in emitted code, are then the same
on every machine, which those of a linear-algebra library are not.
"""

import math

from linkwise.robot.robot import Mat3, Rotation

SWEEPS = 12


def principal_axes(inertia: Mat3) -> Rotation | None:
    """Rotation from the link's frame to its principal axes; None if they agree or depend on parameters."""
    if not all(isinstance(entry, (int, float)) for row in inertia for entry in row):
        return None
    m = [[float(entry) for entry in row] for row in inertia]
    if m[0][1] == m[0][2] == m[1][2] == 0.0:
        return None
    axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    for _ in range(SWEEPS):
        for p, q in ((0, 1), (0, 2), (1, 2)):
            if m[p][q] != 0.0:
                _rotate(m, axes, p, q)
    return tuple(zip(*axes, strict=True))


def _rotate(m: list[list[float]], axes: list[list[float]], p: int, q: int) -> None:
    """Turn m[p][q] to zero; `axes` gathers the turns, an axis a column."""
    theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q])
    t = math.copysign(1.0, theta) / (abs(theta) + math.sqrt(theta * theta + 1.0))
    c = 1.0 / math.sqrt(t * t + 1.0)
    s = t * c
    for row in range(3):
        a, b = m[row][p], m[row][q]
        m[row][p], m[row][q] = c * a - s * b, s * a + c * b
        a, b = axes[row][p], axes[row][q]
        axes[row][p], axes[row][q] = c * a - s * b, s * a + c * b
    for column in range(3):
        a, b = m[p][column], m[q][column]
        m[p][column], m[q][column] = c * a - s * b, s * a + c * b
    m[p][q] = m[q][p] = 0.0
