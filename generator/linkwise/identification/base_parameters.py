"""Base parameters: the combinations of the links' inertial parameters that torques determine.

    W. Khalil, J.-F. Bennis, Int. J. Robotics Research 14(2), 1995; M. Gautier, J. Robotic Systems 8(4), 1991

The regressor of many random motions has dependent columns. QR with column pivoting picks independent ones,
Y P = Q [R1 R2], and the others are their combinations, Y2 = Y1 R1^-1 R2: so with pi1 the picked parameters
Y pi = Y1 beta, beta = pi1 + R1^-1 R2 pi2, whatever the motion. Links of equal design have columns of equal
size, among which rounding would pick: here the first in order is picked, so that every back end names the
same combinations.

Where some joints' torques are not measured, their rows are left out: Y1 of the others, in turn, has dependent
columns, and the same is done once more, with beta for pi.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from linkwise_runtime.certainty.random_motions import Motion, random_motion
from linkwise_runtime.dynamics import Dynamics

from linkwise.arrays import Array, Index

NAMES = ("m", "mcx", "mcy", "mcz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
"""Mass, first moment, and inertia about the origin of the link's frame, in the order of the regressor."""
UNITS = ("kg", *["kg m"] * 3, *["kg m^2"] * 6)

LATER = 0.01
"""Factor for columns of masses, so that a sum is named after, say, the first moment that a mass adds to."""
RANK = 1e-8
"""Part of the largest diagonal entry of R, for columns of one size, below which an entry is rounding."""
TIE = 1e-6
"""Part of the larger column, by which columns may differ and still count as equally large."""
NOTHING = 1e-9
"""Part of a column's size, below which the share of another column is rounding too."""
ROWS = 4
"""Rows of random motion for each column."""


@dataclass(frozen=True)
class BaseParameters:
    """Independent combinations beta = combinations @ pi of all links' parameters, pi of shape (10 N,)."""

    links: tuple[str, ...]
    picked: tuple[int, ...]
    """Positions in pi of the parameter that each combination is named after, ascending."""
    combinations: Array
    """Matrix (base, 10 N), the identity in the picked columns."""
    sizes: Array
    """Root mean square of the picked columns of the regressor over random motions, (base,)."""
    condition: float
    """Condition number of these columns, each divided by its size: the value for a good motion."""
    hidden: tuple[str, ...]
    """Combinations, as texts, that torques of all joints determine, and the measured torques alone do not."""

    @property
    def count(self) -> int:
        """Number of base parameters."""
        return len(self.picked)

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each base parameter."""
        return tuple(UNITS[at % len(NAMES)] for at in self.picked)

    def texts(self) -> list[str]:
        """Return each combination as a sum of the links' parameters, such as m(upper) + 2.5 mcx(lower)."""
        rows = zip(self.combinations, self.picked, strict=True)
        return [combination_text(self.links, row, own) for row, own in rows]


def samples_needed(model: Dynamics, torques: int) -> int:
    """Return the number of samples of random motion that a robot with so many torques needs."""
    return -(-ROWS * len(NAMES) * len(model.link_names) // torques) + ROWS


def base_parameters(
    model: Dynamics, measured: Sequence[int] | None = None, motion: Motion | None = None
) -> BaseParameters:
    """Return the base parameters of a robot, by random motions of up to SPEED.

    Raises the errors of the robot's `regressor`.

    measured: joints, counted from 0, whose torques are measured, in any order; all if not given
    motion: random motions of joints that are tied; those of free joints if not given
    """
    links, n = tuple(model.link_names), len(model.joint_names)
    columns = len(NAMES) * len(links)
    q, qd, qdd = random_motion(n, samples_needed(model, n)) if motion is None else motion
    rows = model.regressor(q, qd, qdd).reshape(len(q), n, columns)
    picked, combinations = _combinations(rows.reshape(-1, columns), np.arange(columns))
    hidden: tuple[str, ...] = ()
    if measured is not None and len(measured) < n:
        every, rows = picked, rows[:, list(measured)]
        among, shares = _combinations(rows[:, :, every].reshape(-1, len(every)), every)
        lost = np.setdiff1d(np.arange(len(every)), among)
        hidden = tuple(combination_text(links, combinations[at], int(every[at])) for at in lost)
        picked, combinations = every[among], shares @ combinations
    shown = rows.reshape(-1, columns)[:, picked]
    sizes = np.sqrt(np.mean(shown**2, axis=0))
    condition = float(np.linalg.cond(shown / sizes))
    return BaseParameters(links, tuple(picked.tolist()), combinations, sizes, condition, hidden)


def _combinations(rows: Array, names: Index) -> tuple[Index, Array]:
    """Return the independent columns, ascending, and the combinations of all columns that they stand for.

    The combinations have shape (independent, columns). names: positions in pi of the parameters that the
    columns are named after
    """
    picked, rest, shares = _independent(rows, np.where(names % len(NAMES), 1.0, LATER))
    combinations = np.zeros((len(picked), rows.shape[1]))
    combinations[np.arange(len(picked)), picked] = 1.0
    combinations[:, rest] = shares
    order = np.argsort(picked)
    return picked[order], combinations[order]


def _independent(rows: Array, weights: Array) -> tuple[Index, Index, Array]:
    """Return the independent columns, the others, and these as combinations of those, (picked, others)."""
    sizes = np.sqrt(np.mean(rows**2, axis=0))
    sizes[sizes <= NOTHING * sizes.max(initial=0.0)] = np.inf  # no motion shows these columns
    sizes = sizes / weights
    q, a, picked = _orthogonal(rows / sizes)
    rest = np.setdiff1d(np.arange(len(sizes)), picked)
    shares = np.linalg.solve(q.T @ a[:, picked], q.T @ a[:, rest])
    shares[np.abs(shares) < NOTHING] = 0.0
    scaled = shares * np.where(np.isinf(sizes[rest]), 0.0, sizes[rest]) / sizes[picked][:, None]
    return picked, rest, scaled


def _orthogonal(rows: Array) -> tuple[Array, Array, Index]:
    """Return Q, a factor R of the columns, and a set of columns that span all, in the order picked.

    R has as few rows as there are columns.
    """
    a: Array = np.asarray(np.linalg.qr(rows, mode="r"))
    left, q, picked = a.copy(), np.zeros((len(a), 0)), list[int]()
    largest = 0.0
    while len(picked) < min(a.shape):
        sizes = np.linalg.norm(left, axis=0)
        at = int(np.argmax(sizes >= (1 - TIE) * sizes.max()))
        largest = max(largest, sizes[at])
        if sizes[at] <= RANK * largest:
            break
        column = left[:, at] - q @ (q.T @ left[:, at])  # once more, to remove what rounding has left
        column /= np.linalg.norm(column)
        left -= np.outer(column, column @ left)
        left[:, at] = 0.0
        q = np.column_stack([q, column])
        picked.append(at)
    return q, a, np.array(picked, dtype=np.intp)


def combination_text(links: Sequence[str], row: Array, own: int) -> str:
    """Return the text of a combination (10 N,) that is named after the parameter at `own`."""

    def name(at: int) -> str:
        link, which = divmod(at, len(NAMES))
        return f"{NAMES[which]}({links[link]})"

    others = [at for at in np.flatnonzero(row).tolist() if at != own]
    return " ".join([name(own), *(_term(row[at], name(at)) for at in others)])


def _term(factor: float, name: str) -> str:
    # Rounded twice: rounding errors do not decide on exact halves of the last digit shown.
    sign, size = ("-" if factor < 0 else "+"), f"{float(f'{abs(factor):.10g}'):.6g}"
    return f"{sign} {name}" if size == "1" else f"{sign} {size} {name}"
