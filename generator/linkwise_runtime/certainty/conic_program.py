"""Semidefinite programs of (4, 4) matrices, solved by Clarabel, and Clarabel for programs of other rooms.

P. Goulart, Y. Chen, arXiv:2405.12762
"""

from importlib import import_module
from typing import Any

import numpy as np

from .pseudo_inertia import Floats

STEP = 0.9
"""Longest step of the solver, as a part of the way to the edge: with longer ones it stalls earlier."""
CLOSE = 1e-12
"""Tolerances of the solver: it goes on until it cannot do better, and the certificate judges."""


def solver(whose: str = "intervals of shares") -> tuple[Any, Any]:
    """Return Clarabel and SciPy's sparse matrices; raise ImportError that says how to install them.

    whose: what needs them, in words
    """
    try:
        return import_module("clarabel"), import_module("scipy.sparse")
    except ImportError:
        raise ImportError(
            f"{whose} need Clarabel and SciPy, which are not installed here: pip install clarabel "
            "scipy, or with linkwise pip install 'linkwise[identify]'"
        ) from None


def conic_least(c: Floats, rows: Floats, ones: Floats, links: int) -> tuple[Floats, Floats]:
    """Return the u of least c . u with ones + rows u in the cones, and the multipliers in these.

    links: number of cones of semidefinite (4, 4) matrices, which come first, ten rows each
    """
    clarabel, sparse = solver()
    settings = clarabel.DefaultSettings()
    settings.verbose = settings.equilibrate_enable = False
    settings.max_step_fraction = STEP
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = CLOSE
    cones = [clarabel.PSDTriangleConeT(4)] * links
    others = len(rows) - 10 * links
    if others:
        cones.append(clarabel.NonnegativeConeT(others))
    nothing = sparse.csc_matrix((len(c), len(c)))
    found = clarabel.DefaultSolver(nothing, c, sparse.csc_matrix(-rows), ones, cones, settings).solve()
    u, z = np.array(found.x), np.array(found.z)
    good = np.isfinite(u).all() and np.isfinite(z).all()
    return (u, z) if good else (np.zeros_like(u), np.zeros_like(z))
