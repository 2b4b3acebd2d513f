"""Second-order cone programs for the forces of contacts, solved by Clarabel.

least z^T z / 2 with   L z + F x = b,   |x_2, x_3| <= mu x_1 for each point, three numbers x each

P. Goulart, Y. Chen, arXiv:2405.12762
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..certainty.conic_program import solver

Floats = NDArray[np.float64]
CLOSE = 1e-12
"""Tolerance of the solver, of equations whose largest number is 1."""
HOLDS = 1e-7
"""Largest part of the largest force by which a cone or an equation may be missed."""


class Cones(NamedTuple):
    """Friction at each point; the first 3 K unknowns are the forces there, normal first."""

    frictions: tuple[float, ...]


class ForceChoice(NamedTuple):
    """Solution of a program."""

    change: Floats
    """z"""
    forces: Floats
    """x, those without limits included."""


class ForceProgram(NamedTuple):
    """Program for one sample."""

    changes: Floats
    """L (rows, z)."""
    forces: Floats
    """F (rows, x)."""
    needed: Floats
    """b (rows,)."""
    cones: Cones

    def shortfall(self) -> tuple[float, list[int]]:
        """Return the force that all cones are short of, at the least, and the points where they are."""
        missed, found = _solved(self, elastic=True)
        return missed, [k for k, over in enumerate(_outside(found, self.cones)) if over > 0.99 * missed]


def least_change(program: ForceProgram) -> ForceChoice | None:
    """Return the solution, or None where there is none."""
    _, found = _solved(program, elastic=False)
    size = max(np.abs(program.needed).max(initial=0.0), np.abs(found.forces).max(initial=0.0), 1e-300)
    left = program.changes @ found.change + program.forces @ found.forces - program.needed
    missed = max(np.abs(left).max(initial=0.0), max(_outside(found, program.cones)))
    return found if missed <= HOLDS * size else None


def _outside(found: ForceChoice, cones: Cones) -> list[float]:
    """Return by how much each force is outside of its cone, negative inside."""
    forces = found.forces[: 3 * len(cones.frictions)].reshape(-1, 3)
    return [float(np.hypot(f[1], f[2]) - mu * f[0]) for f, mu in zip(forces, cones.frictions, strict=True)]


def _solved(program: ForceProgram, elastic: bool) -> tuple[float, ForceChoice]:
    """Return how much wider all cones are made, 0 unless elastic, and the solver's answer.

    elastic: whether cones may be wider by one force, which is then the least, in place of z^T z
    """
    clarabel, sparse = solver("friction cones")
    changes, forces, needed, (frictions,) = program
    size = np.abs(needed).max(initial=0.0) or 1.0
    count, points = changes.shape[1], len(frictions)
    wide = count + forces.shape[1] + 1
    rows = np.zeros((3 * points, wide))
    for k, mu in enumerate(frictions):
        rows[3 * k, count + 3 * k] = -mu
        rows[3 * k, -1] = -1.0
        rows[3 * k + 1 : 3 * k + 3, count + 3 * k + 1 : count + 3 * k + 3] = -np.eye(2)
    last = np.zeros((1, wide))
    last[0, -1] = -1.0  # widened by 0 or more
    equal = np.concatenate([changes, forces, np.zeros((len(needed), 1))], 1)
    whole = np.concatenate([equal, rows, last])
    right = np.concatenate([needed / size, np.zeros(3 * points + 1)])
    cones: list[Any] = [clarabel.ZeroConeT(len(needed)), *[clarabel.SecondOrderConeT(3)] * points]
    cones.append(clarabel.NonnegativeConeT(1) if elastic else clarabel.ZeroConeT(1))
    weights = np.zeros(wide) if elastic else np.r_[np.ones(count), np.zeros(wide - count)]
    cost = np.r_[np.zeros(wide - 1), 1.0 if elastic else 0.0]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = CLOSE
    square = sparse.csc_matrix(np.diag(weights))
    made = clarabel.DefaultSolver(square, cost, sparse.csc_matrix(whole), right, cones, settings)
    x = np.nan_to_num(np.array(made.solve().x)) * size
    return float(x[-1]), ForceChoice(x[:count], x[count:-1])
