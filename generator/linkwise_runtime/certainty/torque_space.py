"""Space of what joint torques determine, found from random motions.

    M. Gautier, W. Khalil, IEEE Trans. Robotics and Automation 6(3), 1990; G. Golub, C. Van Loan, Matrix
    Computations, 5.5 (numerical rank)

Rows W of torques at many random motions map all parameters pi (10 N,) to torques. With the singular value
decomposition of W, its columns scaled to one size, the row space spans all combinations of pi that torques
determine, as many as there are base parameters; its complement Z is what no torque shows. A share y . pi
follows from torques if y lies in the row space: y Z = 0.
"""

from dataclasses import dataclass

import numpy as np

from .pseudo_inertia import Floats

NOTHING = 1e-9
"""Part of the largest column below which a column is rounding: no motion shows it."""
LARGEST_NOISE, LEAST_SIGNAL = 1e-4, 1e-12
"""Parts of the largest singular value: the rank ends below the one and not below the other."""
CLEAN = 1e3
"""Least ratio of the singular values on both sides of the rank."""


@dataclass(frozen=True, eq=False)
class TorqueSpace:
    """Combinations of the parameters of N links that torques determine, and those that they do not."""

    scales: Floats
    """Sizes of the columns, (10 N,), by which they were divided; 1 where no motion shows one."""
    hidden: Floats
    """Orthonormal combinations of scaled parameters that no torque shows, (10 N, 10 N - count)."""
    count: int
    """Number of base parameters."""

    @property
    def hidden_parameters(self) -> Floats:
        """Changes of the parameters pi that change no torque, (10 N, 10 N - count), in its columns."""
        found: Floats = self.hidden / self.scales[:, None]
        return found

    def leaning(self, rows: Floats, link: int | None = None) -> Floats:
        """Return the part of each row (..., 10 N) that leans on what torques do not show, (...), 0 to 1.

        link: the one whose ten columns (..., 10) the rows are; None for rows of all links. Rows of zeros have
        nothing that leans: 0.
        """
        columns = slice(None) if link is None else slice(10 * link, 10 * link + 10)
        scaled = rows / self.scales[columns]
        sizes = np.linalg.norm(scaled, axis=-1)
        found: Floats = np.linalg.norm(scaled @ self.hidden[columns], axis=-1)
        return found / np.where(sizes > 0.0, sizes, 1.0)


def torque_space(rows: Floats, name: str) -> TorqueSpace:
    """Return the space of rows (T, 10 N) of torques at random motions.

    Raises ValueError, with the robot's name, where rounding does not let the rank be told.
    """
    scales = np.sqrt(np.mean(rows**2, axis=0))
    unseen = scales <= NOTHING * scales.max(initial=0.0)
    scales[unseen] = 1.0
    factor = np.linalg.qr(np.where(unseen, 0.0, rows / scales), mode="r")
    _, sizes, right = np.linalg.svd(factor)
    parts = np.maximum(sizes / (sizes.max(initial=0.0) or 1.0), np.finfo(float).tiny)
    ends = [at for at in range(1, len(parts)) if parts[at] < LARGEST_NOISE and parts[at - 1] > LEAST_SIGNAL]
    count = max(ends, key=lambda at: parts[at - 1] / max(parts[at], LEAST_SIGNAL), default=len(parts))
    if not sizes.any():
        count = 0
    elif count < len(parts) and parts[count - 1] < CLEAN * parts[count]:
        raise ValueError(
            f"torques of {name} do not say clearly what they determine: singular values "
            f"{parts[count - 1]:.1e} and {parts[count]:.1e} are too close; measure other joints, or see that "
            "no joint, length or mass is almost, but not quite, zero"
        )
    return TorqueSpace(scales, right[count:].T, count)
