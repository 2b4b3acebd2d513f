"""Torques of the joints that something drives, for what a motion needs of all joints.

A motion needs torques t (..., n) of the joints, up to forces of ties: with S that chooses the driven joints,
the coordinates y of `Freedom` and the inertia H of joints, torques u of the driven ones give it if

    E^T u = G^T t        E = S G

Where E^T has fewer rows than columns, as where feet on the ground make torques redundant, many u do; taken
is that of the least u^T W u, u = W^-1 E (E^T W^-1 E)^-1 G^T t. Where there are motions w with E w = 0, in
which no driven joint takes part, nothing can drive these: with P their projector, 1 - E^+ E,

    E^T u = (1 - G^T H G B) G^T t        B = (P G^T H G P)^+

leaves them to themselves, -B G^T t, while all driven joints still have the accelerations that were asked for.
By Gauss's principle this is the attainable acceleration nearest to the wanted one, by the inertia G^T H G.

M. Mistry, J. Buchli, S. Schaal, Inverse dynamics control of floating base systems using orthogonal
decomposition, 2010; L. Righetti, J. Buchli, M. Mistry, M. Kalakrishnan, S. Schaal, Optimal distribution of
contact forces with inverse-dynamics control, 2013; M. Spong, Partial feedback linearization of underactuated
mechanical systems, 1994.
"""

from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from ..answers.inertia_solve import moving_most
from ..arguments import kept_numbers
from ..arrays.backend import ArrayBackend
from ..chosen_names import listed, sample_of, short
from ..constraints.chosen_constraints import TreeConstraints
from ..constraints.independent_joints import RANK, loose_base
from ..constraints.robot_constraints import Constraints
from ..interface import Namespace, Numbers, array_of, epsilon_of, is_traced, namespace
from ..structure import Structure
from .freedom import Freedom

BESIDE = 0.05
"""Distance, in rad and m, to the place beside a chosen one where ranks are looked at again."""


class Drive(NamedTuple):
    """Torques of the driven joints at one state or at many."""

    torque: Numbers
    """u on all joints, (..., n), zero on those that nothing drives."""
    left: Numbers | None
    """Acceleration that joints have beside the one asked for, (..., n), as nothing drives it; None: none."""


class Actuators:
    """Joints of a robot that something drives."""

    def __init__(
        self, structure: Structure, constraints: Constraints[Any] | None, driven: object, weight: object
    ) -> None:
        """Read which joints are driven; raises as `Dynamics.partial_impedance` does.

        driven: joints by name or number; None for all that it says
        weight: one number for each driven joint, or None
        """
        self._structure, self._constraints = structure, constraints
        self.joints = _driven(structure, constraints, driven)
        """Indices of the driven joints, in the order of all joints."""
        self.names = tuple(structure.joint_names[i] for i in self.joints)
        self.weight = _weight(weight, self.names)
        """W: one number for each driven joint."""
        self._rank, freedoms = self._rank_of_freedoms()
        self.undriven = freedoms - self._rank
        """Number of independent motions in which no driven joint takes part."""
        self.drive_all = constraints is None and len(self.joints) == structure.n

    def _rank_of_freedoms(self) -> tuple[int, int]:
        """Return the rank of E, and the number of coordinates y.

        It is the larger of those where the constraints were chosen, which may be a place of symmetry, and
        beside it.
        """
        if self._constraints is None:
            return len(self.joints), self._structure.n
        chosen = self._constraints.closed_position
        chosen = chosen.reshape(-1, chosen.shape[-1])[0]
        aside = BESIDE * np.random.default_rng(0).uniform(-1.0, 1.0, len(chosen))
        ranks = [self._rank_at(chosen)]
        with suppress(ValueError):  # where the ties do not close from there, or joints tell nothing
            ranks.append(self._rank_at(array_of(self._constraints.closed(chosen + aside))))
        return max(ranks), len(self._constraints.independent)

    def _rank_at(self, q: NDArray[Any]) -> int:
        """Return the rank of E at a closed position (n,)."""
        assert self._constraints is not None  # who has none has no E
        mapped = array_of(self._constraints.velocity_map(q)).astype(float)
        own = mapped.reshape(-1, *mapped.shape[-2:])[0][list(self.joints)]
        values = np.linalg.svd(own, compute_uv=False)
        return int((values > RANK * max(1.0, values.max(initial=0.0))).sum())

    def driving(self, backend: ArrayBackend, freedom: Freedom, inertia: Numbers, needed: Numbers) -> Drive:
        """Return the torques for what a motion needs of the joints.

        inertia: H (..., n, n); needed: t (..., n)
        """
        if self.drive_all:
            return Drive(needed, None)
        xp, force = backend.xp, freedom.projected(needed[..., None])
        own = self._own(backend, freedom, needed)
        size = backend.constant(self.weight**-0.5, needed)
        given = own.mT * size
        self._check(own, freedom)
        left = None
        if self.undriven:
            mass = freedom.inner(inertia)
            free = self._free_response(own, mass, freedom.names)
            left = -freedom.moved(free @ force)[..., 0]
            force = force - mass @ (free @ force)
        chosen = (_inverse(given) @ force)[..., 0] * size
        every = xp.concat([chosen, xp.zeros_like(needed)], -1)  # where nothing drives, an entry of the zeros
        rest = range(len(self.joints), len(self.joints) + self._structure.n - len(self.joints))
        at = np.empty(self._structure.n, np.intp)
        at[list(self.joints)] = np.arange(len(self.joints))
        at[[i for i in range(self._structure.n) if i not in self.joints]] = list(rest)
        return Drive(every[..., backend.index(at, needed)], left)

    def idle(self, mapped: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return W^(-1/2) V of one sample, (driven joints, X): orthonormal changes V that move nothing.

        mapped: G (n, m)
        """
        size = self.weight**-0.5
        across = np.linalg.svd(mapped[list(self.joints)].T * size)[2]
        return np.asarray(size[:, None] * across[self._rank :].T)

    def _own(self, backend: ArrayBackend, freedom: Freedom, like: Numbers) -> Numbers:
        """Return E (..., driven joints, m)."""
        rows = backend.index(np.array(self.joints, np.intp), like)
        if freedom.place is not None:
            return freedom.place.found.map[..., rows, :]
        unit = backend.constant(np.eye(self._structure.n)[list(self.joints)], like)
        return unit + 0.0 * like[..., None, :]

    def _free_response(self, own: Numbers, mass: Numbers, names: Sequence[str]) -> Numbers:
        """Return B (..., m, m)."""
        xp: Namespace = namespace(own)
        lost = _inverse(own) @ own
        free = xp.eye(lost.shape[-1], dtype=lost.dtype) - lost
        inner = free @ mass @ free
        if not is_traced(inner):
            least, most = _sizes(array_of(inner))[..., self.undriven - 1], array_of(mass).max((-2, -1))
            _refuse(least <= epsilon_of(inner) * most, lambda at: _massless(array_of(free)[at], names))
        return _inverse(inner)

    def _check(self, own: Numbers, freedom: Freedom) -> None:
        """Raise ValueError for the first sample where driven joints move less than elsewhere.

        There E has lost its rank, as far as half of the digits tell, beside the largest motion of a joint.
        """
        if is_traced(own) or freedom.place is None:
            return
        matrices, most = array_of(own), np.abs(array_of(freedom.place.found.map)).max((-2, -1))
        least = _sizes(matrices)[..., self._rank - 1]
        lost = least <= epsilon_of(own) ** 0.5 * most

        def told(at: tuple[int, ...]) -> str:
            still = np.linalg.svd(matrices[at].astype(float))[2][self._rank - 1]
            return (
                f"what drives the robot, {listed(list(self.names))}, cannot drive "
                f"{listed(moving_most(still, freedom.names, 0.1))}"
                "{}, as at a dead centre; keep away from there, or name further joints in actuated="
            )

        _refuse(lost, told)


def _massless(free: NDArray[np.floating], names: Sequence[str]) -> str:
    moving = moving_most(np.linalg.svd(free)[0][:, 0], names, 0.1)
    return (
        f"nothing drives {listed(moving)}" + "{}, which can move without moving any mass, so that no "
        "acceleration follows"
    )


def _refuse(wrong: NDArray[np.bool_], told: Any) -> None:
    """Raise ValueError for the first sample, with what is told of it."""
    if wrong.any():
        at = tuple(np.argwhere(wrong)[0].tolist())
        raise ValueError(told(at).format(sample_of(at)))


def _inverse(matrix: Numbers) -> Numbers:
    """Return the pseudoinverse: singular values of nothing but rounding count as zero."""
    finite, kept = _finite(matrix)
    xp = namespace(matrix)
    inverse: Numbers = xp.where(finite, xp.linalg.pinv(kept, rtol=_rounding(matrix)), np.nan)
    return inverse


def _sizes(matrix: NDArray[Any]) -> NDArray[np.floating]:
    """Return the singular values, (..., X)."""
    finite, kept = _finite(matrix)
    values = np.linalg.svd(cast(NDArray[Any], kept), compute_uv=False)
    return np.where(cast(NDArray[np.bool_], finite)[..., 0], values, np.nan)


def _finite(matrix: Numbers) -> tuple[Numbers, Numbers]:
    """Return which samples (..., 1, 1) are numbers, and the matrices with zeros for those that are not.

    LAPACK gives none of all samples an answer if one has a NaN.
    """
    xp = namespace(matrix)
    finite = xp.isfinite(matrix).all(-1)[..., None].all(-2)[..., None]
    return finite, xp.where(finite, matrix, xp.zeros_like(matrix))


def _rounding(like: Numbers) -> float:
    """Return the part of the largest singular value at or below which only rounding is left of one."""
    return float(epsilon_of(like) ** (2.0 / 3.0))


def _driven(structure: Structure, constraints: Constraints[Any] | None, given: object) -> tuple[int, ...]:
    """Return the indices of the driven joints; raises ValueError and TypeError for what are none."""
    if given is None:
        return _driven_unless_given(structure, constraints)
    if isinstance(given, str) or not isinstance(given, list | tuple):
        raise TypeError(f"actuated is {short(given)}; give a list of joints by number or by name")
    chosen = sorted(structure.joint_index(joint, "actuated") for joint in given)
    if len(set(chosen)) < len(chosen):
        raise ValueError(f"actuated is {short(given)}, which names a joint twice")
    if not chosen:
        raise ValueError("actuated names no joint, so that nothing could be controlled; name one or more")
    return tuple(chosen)


def _driven_unless_given(structure: Structure, constraints: Constraints[Any] | None) -> tuple[int, ...]:
    """Return all joints but those that follow by ties, and with contacts those of a floating base."""
    if constraints is None:
        return tuple(range(structure.n))
    chosen = constraints.ties.chosen
    if not isinstance(chosen, TreeConstraints) or not chosen.has_contacts:
        return chosen.independent
    tree = chosen.tree
    base = loose_base(tree)
    return tuple(k for k in tree.independent or range(structure.n) if k not in base)


def _weight(given: object, names: Sequence[str]) -> NDArray[np.float64]:
    """Return W; raises ValueError for what is not a number above 0 for each driven joint."""
    if given is None:
        return np.ones(len(names))
    weight = kept_numbers("torque_weight", given)
    if weight is None or weight.shape != (len(names),) or not (weight > 0.0).all():
        raise ValueError(
            f"torque_weight is {short(given)}; give a number above 0 for each of {listed(list(names))}"
        )
    return weight
