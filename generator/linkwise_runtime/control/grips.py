"""Friction cones and unilateral contacts: the torques nearest to the least ones under which contacts hold.

Under torques u of the driven joints ties and contacts bear lambda, with t (..., n) what the motion needs:

    A^T lambda = t - S^T u        u = u_0 + W^(-1/2) V z        lambda = X f + Y mu

u_0 are the least torques, V the changes that move nothing (`Actuators`), f the forces at the points where
gripped contacts touch, and mu what all others bear. Of all z, f and mu with |f_t| <= friction f_n at each
point, that of the least z^T z is taken, and so of the least u^T W u: a second-order cone program for each
sample, which Clarabel solves.

S. Caron, Q.-C. Pham, Y. Nakamura, Stability of surface contacts for humanoid robots: closed-form formulae of
the contact wrench cone for rectangular support areas, 2015, has the wrenches of forces at corners; torques
are chosen as L. Righetti et al., 2013, choose them (`actuators`).
"""

from collections.abc import Sequence
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import kept_numbers
from ..arrays.backend import ArrayBackend
from ..chosen_names import known_kind, listed, sample_of, short
from ..constraints.chosen_constraints import TreeConstraints
from ..constraints.closed_places import tie_forces, times
from ..constraints.held_frames import Held, ground_normal
from ..constraints.robot_constraints import Constraints
from ..interface import Numbers, array_of, is_traced, side_by_side
from ..quantities import Contact
from ..targets import Grip
from .actuators import Actuators
from .force_program import Cones, ForceProgram, least_change
from .freedom import Freedom

Floats = NDArray[np.float64]
IDLE = 1e-6
"""Change of torques, as a part of the least ones, that counts as none: contacts hold under the least ones."""


class Gripped(NamedTuple):
    """A contact with limits, read."""

    held: Held
    rows: slice
    """Rows of the contact among those of the constraints."""
    friction: float
    corners: Floats
    """Points of the frame, (K, 3); that of the contact where it touches at one place."""
    axes: Floats
    """Normal of the ground, and two axes across it, in columns (3, 3)."""


class ContactTorques(NamedTuple):
    """Torques under which contacts hold, and what these bear."""

    torque: Numbers
    """Torques on all joints, (..., n)."""
    forces: Numbers
    """lambda (..., C)."""


class SampleProgram(NamedTuple):
    """Program of one sample, and what its unknowns stand for."""

    program: ForceProgram
    moves: Floats
    """Changes of torques on all joints, (n, z)."""
    borne: Floats
    """X and Y side by side, (C, x)."""


class Grips:
    """Limits of a robot's contacts."""

    def __init__(self, constraints: Constraints[Any] | None, actuators: Actuators, given: object) -> None:
        """Read limits; raises as `Dynamics.partial_impedance` does."""
        self._actuators, self._names = actuators, actuators.names
        self.gripped = tuple(_read(constraints, given))
        if self.gripped:
            assert constraints is not None  # whose contacts these are
            self._rows = len(constraints.rows)

    def __bool__(self) -> bool:
        return bool(self.gripped)

    def borne(
        self,
        backend: ArrayBackend,
        freedom: Freedom,
        needed: Numbers,
        least: Numbers,
    ) -> ContactTorques:
        """Return the torques nearest to the least ones under which all contacts hold.

        needed: t on all joints, (..., n); least: u_0 on all joints, (..., n)
        Raises ValueError, with the sample and the contacts, where no torques do, and where a gradient is
        recorded though limits shape the torques, or numbers cannot be looked at.
        """
        place = freedom.place
        assert place is not None  # contacts are constraints
        if is_traced(needed):
            raise ValueError(
                "grips= looks at the numbers of each sample, which vmap and compilers hide; leave it out"
            )
        frames = [one.held.first for one in self.gripped]
        poses = [_numbers(backend.frames.answer("pose", [place.q], k)) for k in frames]
        across = side_by_side(place.made.positions()[..., 1:])
        rows, mapped, total = _numbers(across), _numbers(place.found.map), _numbers(needed)
        others = array_of(place.found.columns.dependent)
        moves, forces = 0.0 * total, np.zeros(rows.shape[:-1])
        for at in np.ndindex(total.shape[:-1]):
            there = _numbers(least)[at]
            if not np.isfinite(there).all():
                forces[at] = np.nan
                continue
            program = self._program(mapped[at], rows[at], total[at] - there, others, [p[at] for p in poses])
            found = least_change(program.program)
            if found is None:
                raise ValueError(self._lost(program.program, at))
            move = program.moves @ found.change
            if np.abs(move).max(initial=0.0) > IDLE * np.abs(there).max(initial=0.0):
                moves[at] = move
            forces[at] = program.borne @ found.forces
        told = self._moved(backend, least, moves)
        # What the solver leaves of the equation, by the least forces.
        near = backend.constant(forces, least)
        left = needed - told - times(across.mT, near)
        return ContactTorques(told, near + tie_forces(place.found, left[..., None])[..., 0])

    def _moved(self, backend: ArrayBackend, least: Numbers, moves: Floats) -> Numbers:
        """Return changed torques; raises ValueError where they are changed while a gradient is recorded."""
        if not moves.any():
            return least
        if getattr(least, "requires_grad", False):
            raise ValueError(
                f"the limits of {listed([one.held.name for one in self.gripped])} shape these torques, which "
                "have no gradient there; leave grips= out while gradients are recorded, or ask for motions "
                "under which contacts hold by themselves"
            )
        return least + backend.constant(moves, least)

    def _program(
        self,
        mapped: Floats,
        rows: Floats,
        total: Floats,
        others: NDArray[Any],
        poses: Sequence[Floats],
    ) -> SampleProgram:
        """Return the program of one sample.

        mapped: G (n, m); rows: A (C, n); total: what ties and contacts give under the least torques, (n,)
        """
        idle = self._actuators.idle(mapped)
        moves = np.zeros((len(total), idle.shape[1]))
        moves[list(self._actuators.joints)] = idle
        borne, cones = self._maps(poses)
        program = ForceProgram(moves[others], rows[:, others].T @ borne, total[others], cones)
        return SampleProgram(program, moves, borne)

    def _maps(self, poses: Sequence[Floats]) -> tuple[Floats, Cones]:
        """Return X and Y side by side, (C, unknowns), and the cones of the first of these unknowns.

        Unknowns are the force at each point, along the axes of its ground, then rows without limits.
        """
        columns: list[Floats] = []
        frictions: list[float] = []
        free = np.ones(self._rows, bool)
        for one, pose in zip(self.gripped, poses, strict=True):
            free[one.rows] = False
            for corner in one.corners:
                part = np.zeros((self._rows, 3))
                arm = pose[:3, :3] @ (corner - np.array(one.held.point))
                moment = np.cross(arm, one.axes.T).T
                has_moment = one.held.kind == "frame"
                part[one.rows] = np.concatenate([moment, one.axes]) if has_moment else one.axes
                columns.append(part)
                frictions.append(one.friction)
        return np.concatenate([*columns, np.eye(self._rows)[:, free]], 1), Cones(tuple(frictions))

    def _lost(self, program: ForceProgram, at: Sequence[int]) -> str:
        """Return in words which contacts no torques keep."""
        short_by, worst = program.shortfall()
        owners = [one for one in self.gripped for _ in one.corners]
        named = list(dict.fromkeys(owners[k].held.name for k in worst))
        slips = "slips or lifts off" if len(named) == 1 else "slip or lift off"
        return (
            f"{listed(named)} {slips}{sample_of(at)}: no torques of {listed(list(self._names))} give this "
            f"motion with forces inside the friction cones, which are short by {short_by:.3g} N; ask for "
            "less acceleration, or let go of contacts in robot.constrained(...)"
        )


def _numbers(values: Numbers) -> Floats:
    """Return an array of float64."""
    return array_of(values).astype(float)


def _read(constraints: Constraints[Any] | None, given: object) -> list[Gripped]:
    """Return the limits; raises TypeError and ValueError that name what is wrong."""
    if isinstance(given, Grip) or not isinstance(given, list | tuple):
        raise TypeError(f"grips is {known_kind(given, Grip)}; give a list of Grip")
    if not given:
        return []
    chosen = None if constraints is None else constraints.ties.chosen
    if not isinstance(chosen, TreeConstraints) or not chosen.has_contacts:
        raise ValueError(
            "grips has limits, but no contact holds: give constraints=robot.constrained(contacts=[...])"
        )
    found, named = [], set()
    for number, grip in enumerate(given):
        where = f"grips[{number}]"
        if not isinstance(grip, Grip):
            raise TypeError(f"{where} is {known_kind(grip, Grip)}; give a Grip")
        found.append(_gripped(chosen, grip, where))
        if grip.contact in named:
            raise ValueError(f"{where} is of {short(grip.contact)}, as another is; give each contact one")
        named.add(grip.contact)
    return found


def _gripped(chosen: TreeConstraints, grip: Grip, where: str) -> Gripped:
    contacts = {one.name: one for one in chosen.held if one.second is None}
    if grip.contact not in contacts:
        raise ValueError(f"{where}.contact is {short(grip.contact)}; choose {listed(list(contacts))}")
    held = contacts[grip.contact]
    if held.kind == "hinge":
        raise ValueError(
            f"{where} is of {short(held.name)}, which is hinged; hold two points of its line in its place"
        )
    mu = grip.friction
    if isinstance(mu, bool) or not isinstance(mu, Real) or not 0.0 <= mu < np.inf:
        raise ValueError(f"{where}.friction is {short(mu)}; give a number, 0 or above")
    normal: Sequence[float] = held.arm
    if grip.normal is not None or not any(held.arm):
        normal = ground_normal(Contact(0, normal=grip.normal), where, chosen.tree.gravity)
    own = [k for k, name in enumerate(chosen.row_names) if name == held.name]
    return Gripped(
        held, slice(own[0], own[-1] + 1), float(mu), _corners(held, grip, where), _axes_along(normal)
    )


def _corners(held: Held, grip: Grip, where: str) -> Floats:
    """Return the points where a contact touches, (K, 3)."""
    corners = kept_numbers(f"{where}.corners", grip.corners)
    if held.kind != "frame":
        if corners is None or corners.size:
            raise ValueError(
                f"{where}.corners is given, but {held.name} touches at one point; leave it out, or hold the "
                "whole frame"
            )
        return np.array([held.point], float)
    if corners is None or corners.ndim != 2 or corners.shape[1] != 3:
        raise ValueError(
            f"{where}.corners is {short(grip.corners)}; {held.name} bears moments: give three points or more "
            "(x, y, z) of its frame where it touches, in m"
        )
    if np.linalg.matrix_rank(corners - corners[0], 1e-9) < 2:
        raise ValueError(f"{where}.corners lie in one line, about which nothing bears a moment; give others")
    return corners


def _axes_along(normal: Sequence[float]) -> Floats:
    """Return axes (3, 3) in columns, of which the first points along the normal."""
    first = np.array(normal) / np.linalg.norm(normal)
    second = np.cross(np.eye(3)[np.abs(first).argmin()], first)
    second /= np.linalg.norm(second)
    return np.stack([first, second, np.cross(first, second)], 1)
