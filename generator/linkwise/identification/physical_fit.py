"""Parameters of every link that fit the log and that a physical body can have: a semidefinite program.

    minimise   || W (B pi, f) - tau ||^2  +  || (pi - pi0) / size ||^2
    over       J(pi_j) >= a speck, f >= 0

W and tau are the weighted equations of `fit`, B the base parameters' combinations, J the pseudo-inertia, f
the friction. The second term determines what torques do not show: there the links keep the robot's own
parameters pi0, as if each were known to within its own size; where the log has any information, that
outweighs the second term by far. Solved by Clarabel (P. Goulart, Y. Chen, arXiv:2405.12762), an
interior-point method.
"""

from dataclasses import dataclass

import numpy as np
from linkwise_runtime.certainty.pseudo_inertia import link_sizes, pseudo_inertia, triangle

from linkwise.arrays import Array, Mask
from linkwise.errors import LinkwiseError
from linkwise.extras import extra
from linkwise.identification.base_parameters import NAMES, BaseParameters
from linkwise.identification.fit import Fit

SPECK = 1e-6
"""Part of a link's size by which a body stays inside the feasible set, so that rounding keeps it there."""
SLIGHT = 0.01
"""Part of its standard error, below which friction is what the solver leaves of zero."""
SOLVED = ("Solved", "AlmostSolved")


@dataclass(frozen=True, eq=False)
class PhysicalFit:
    """Parameters of links (N, 10), of bodies that can exist, and friction (B, 2) as in `Fit`, at least 0."""

    pi: Array
    friction: Array


def physical_fit(fit: Fit, base: BaseParameters, own: Array, rubs: Mask) -> PhysicalFit:
    """Return bodies near the robot's `own` parameters (N, 10), and friction where a joint rubs, (B,).

    Raises LinkwiseError where the solver fails.
    """
    sizes = link_sizes(own)
    count = own.size
    frictions = 2 * int(rubs.sum())
    rubbing = _friction_sizes(fit, rubs)
    scale = np.concatenate([sizes.reshape(-1), rubbing])
    reach = np.zeros((base.count + frictions, count + frictions))
    reach[: base.count, :count] = base.combinations
    reach[base.count :, count:] = np.eye(frictions)
    equations = fit.triangle[:-1, :-1] @ reach * scale
    prior = np.eye(count, count + frictions)
    left = np.concatenate([equations, prior])
    right = np.concatenate([fit.triangle[:-1, -1], (own / sizes).reshape(-1)])
    x = scale * _within_cones(left, right, sizes, frictions)
    friction = np.zeros_like(fit.friction)
    friction[rubs] = x[count:].reshape(-1, 2)
    friction[friction < SLIGHT * fit.friction_errors] = 0.0
    return PhysicalFit(x[:count].reshape(own.shape), np.maximum(friction, 0.0))


def _within_cones(left: Array, right: Array, sizes: Array, frictions: int) -> Array:
    """Return the x of least ||left x - right|| that the links' pseudo-inertias and the frictions allow.

    With left = Q R and y = R x - Q^T right, the distance from the unconstrained minimum, the objective is
    1/2 y^T y but for a constant: perfectly conditioned.
    """
    clarabel, sparse = extra("clarabel"), extra("scipy.sparse")
    q, r = np.linalg.qr(left)
    cones, rows, bounds = [], [], []
    for j, size in enumerate(sizes):
        block = np.zeros((len(NAMES), left.shape[1]))
        block[:, j * len(NAMES) : (j + 1) * len(NAMES)] = np.diag(size)
        length = np.sqrt(size[4] / size[0])
        frame = np.diag([1 / length] * 3 + [1.0]) / np.sqrt(size[0])
        matrices = [frame @ pseudo_inertia(unit) @ frame for unit in np.eye(len(NAMES))]
        rows.append(-triangle(np.stack(matrices)).T @ block)
        bounds.append(-SPECK * triangle(np.eye(4)))
        cones.append(clarabel.PSDTriangleConeT(4))
    if frictions:
        rows.append(-np.eye(frictions, left.shape[1], left.shape[1] - frictions))
        bounds.append(np.zeros(frictions))
        cones.append(clarabel.NonnegativeConeT(frictions))
    constraints = np.linalg.solve(r.T, np.concatenate(rows).T).T
    least = q.T @ right
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    count = left.shape[1]
    solution = clarabel.DefaultSolver(
        sparse.identity(count, format="csc"),
        np.zeros(count),
        sparse.csc_matrix(constraints),
        np.concatenate(bounds) - constraints @ least,
        cones,
        settings,
    ).solve()
    if str(solution.status) not in SOLVED:
        raise LinkwiseError(
            f"no bodies that can exist fit these torques (the solver ended with {solution.status}); see that "
            "the torques are in N m, and of this robot"
        )
    x: Array = np.linalg.solve(r, least + np.array(solution.x))
    return x


def _friction_sizes(fit: Fit, rubs: Mask) -> Array:
    """Return a unit for each friction: the larger of its value and its standard error; 1 where both are 0."""
    found = np.maximum(np.abs(fit.friction), fit.friction_errors)[rubs].reshape(-1)
    sizes: Array = np.where(found > 0, found, 1.0)
    return sizes
