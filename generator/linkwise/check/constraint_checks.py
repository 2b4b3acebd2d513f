"""Checks of a back end's constraints, and of induced accelerations in loops, against `loop_reference`."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.rule.joint_tree import JointTree

from linkwise.arrays import Array
from linkwise.check.compare import Entries, Result, compare, skipped
from linkwise.oracle.contacts import KINDS, ContactEquations
from linkwise.oracle.held_motion import condition_of, far_from_singular, held_motion, steady, with_noise
from linkwise.oracle.loop_equations import LoopEquations, following
from linkwise.oracle.loop_reference import LoopReference
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.oracle.rounding import measure_rounding
from linkwise.oracle.states import States
from linkwise.package.manifest import Manifest

TOLD = "in closed loops against least squares"
PERTURBED = 1e-3
"""Largest displacement of dependent joints before loops are closed again, in rad and m."""
CHANGED = 0.1
"""Largest relative change of A_d by such a displacement; one that changes it more is halved."""
HALVED = 40
"""Most times that a displacement is halved."""
SETTLED = 1e-11
"""Accuracy to which loops are closed again, for positions of size 1."""


def loop_calls(name: str, model: Dynamics, reference: LoopReference) -> Iterator[Result]:
    """Yield the results of one back end."""
    yield compare(f"{name}: velocities {TOLD}", _velocities(model, reference))
    yield compare(f"{name}: shares {TOLD}", _shares(model, reference))
    yield compare(f"{name}: forces and accelerations {TOLD}", _forces(model, reference))
    for what, call in (("accelerations", "induced_accelerations"), ("reactions", "induced_reactions")):
        q, qd, _ = reference.states.motion
        found = getattr(model, call)(q, qd, reference.tau, passive=False)
        entries = [
            _entries(reference, f"{source}: {what}", getattr(found, source))
            for source in ("actuators", "velocity", "gravity", "constraints")
        ]
        yield compare(f"{name}: induced {what} {TOLD}", entries)


def _entries(reference: LoopReference, what: str, found: Any) -> Entries:
    return Entries(what, found, reference.values[what], reference.scales[what])


def _velocities(model: Dynamics, reference: LoopReference) -> Iterator[Entries]:
    (q, qd, qdd), own = reference.states.motion, list(reference.independent)
    constraints = model.constraints
    # Closing stops once steps no longer matter: a position is only so near, not as near as rounding allows.
    closed, size = constraints.closed(q + _away(reference)), 1.0 + np.abs(q).max(-1, keepdims=True)
    if reference.leads_back:
        yield Entries("closed", closed, q, np.broadcast_to(size, q.shape) * SETTLED / np.finfo(float).eps)
    else:
        left = np.asarray(constraints.violation(closed))
        yield Entries("closed", left, 0.0 * left, size * SETTLED / np.finfo(float).eps + 0.0 * left)
    found = {
        "violation": constraints.violation(q),
        "jacobian": constraints.jacobian(q),
        "jacobian_rate": constraints.jacobian_rate(q, qd),
        "velocity_map": constraints.velocity_map(q),
        "velocity": constraints.velocity(q, qd[:, own]),
        "acceleration": constraints.acceleration(q, qd, qdd[:, own]),
        "velocity_accelerations": constraints.velocity_accelerations(q, qd).sum(-1),
    }
    yield from (_entries(reference, what, value) for what, value in found.items())


def _away(reference: LoopReference) -> Array:
    """Return displacements (samples, n) of dependent joints, so small that Newton's method leads back.

    It does where A_d changes on the way by a small part of itself only (Kantorovich): next to a dead point
    another position closes the loop too, however near.
    """
    q, rest = reference.states.q, [k for k in range(reference.tau.shape[1]) if k not in reference.independent]
    away = np.zeros_like(q)
    away[:, rest] = np.random.default_rng(6).uniform(-PERTURBED, PERTURBED, (len(q), len(rest)))
    there = reference.equations.rows(q)[..., rest]
    inverse = np.linalg.pinv(there)
    for _ in range(HALVED):
        change = reference.equations.rows(q + away)[..., rest] - there
        far = np.linalg.norm(inverse @ change, 2, (1, 2)) > CHANGED
        if not far.any():
            break
        away[far] /= 2.0
    return away


def _shares(model: Dynamics, reference: LoopReference) -> Iterator[Entries]:
    constraints, motion = model.constraints, reference.states.motion
    (q, qd, qdd), own = motion, list(reference.independent)
    yield _entries(reference, "tau^", constraints.partial_torque(*motion))
    yield _entries(reference, "sum of tau^", constraints.inverse_dynamics(*motion))
    coefficients, parts = constraints.coefficients(q, qd), constraints.propagation(*motion)
    factors: Sequence[Array] = (qdd[:, None, None, own], qd[:, None, None, own], np.ones((1, 1, 1)))
    for what, value, part, factor in zip(("c2^", "c1^", "g^"), coefficients, parts, factors, strict=True):
        yield _entries(reference, what, value)
        expected, scale = (source[what] for source in (reference.values, reference.scales))
        yield Entries(f"{what} times its motion", part, expected * factor, scale * np.abs(factor).max())
    yield _entries(reference, "projected", constraints.projected(q, reference.tau))


def _forces(model: Dynamics, reference: LoopReference) -> Iterator[Entries]:
    constraints, (q, qd, qdd) = model.constraints, reference.states.motion
    yield _entries(reference, "lambda of links", constraints.forces(q, qd, qdd))
    found = constraints.forward_dynamics(q, qd, reference.tau, passive=False)
    yield _entries(reference, "qdd", found.qdd)
    yield _entries(reference, "lambda", found.forces)


STATES = 2
TRIED = 6


class HeldContacts:
    """Contacts of each kind on the frame that most joints move, at states in which ties close."""

    def __init__(self, manifest: Manifest, tree: JointTree, states: States) -> None:
        at = max((f for f in tree.frames if f.joint is not None), key=lambda f: len(tree.chain(f.joint)))
        self.manifest, self.tree, self.frame = manifest, tree, tree.frames.index(at)
        self.states = states.at(slice(0, TRIED))
        self._kept: dict[tuple[str, tuple[int, ...]], _Expected | None] = {}

    def calls(self, name: str, model: Dynamics, contact: Callable[..., Any]) -> Iterator[Result]:
        """Yield one result of a back end for all kinds; contact: the package's own record."""
        kinds = [kind for kind in KINDS if self._leaves_freedom(kind)]
        entries = [entry for kind in kinds for entry in self._compared(model, kind, contact)]
        if not kinds:
            return
        if entries:
            yield compare(f"{name}: contacts against least squares", entries)
        else:
            told = "each is next to a singular position, or to a singular mass matrix, at every state"
            yield skipped(f"{name}: contacts", told)

    def equations(self, kind: str, tree: JointTree) -> ContactEquations:
        """Return the contact equations of a tree, which may be a noisy one."""
        recursion = NewtonEuler(self.manifest, tree)
        ties = LoopEquations(recursion, tree) if tree.tied else None
        return ContactEquations(recursion, ties, tree.frames[self.frame], kind)

    def _leaves_freedom(self, kind: str) -> bool:
        """Return whether joints can move under a contact of this kind."""
        return bool(self.equations(kind, self.tree).freedoms(self.states.q).min() > 0)

    def _compared(self, model: Any, kind: str, contact: Callable[..., Any]) -> Iterator[Entries]:
        """Yield entries of one kind; none where no state is far enough from singular positions."""
        held = self.equations(kind, self.tree)
        made = model.constrained(contacts=[contact(**held.arguments)])
        own = tuple(model.joint_names.index(name) for name in made.independent)
        if (kind, own) not in self._kept:
            self._kept[kind, own] = self._expected(held, own)
        expected = self._kept[kind, own]
        if expected is not None:
            for what, found in _found(made, held, expected.moved, expected.given).items():
                yield Entries(f"{kind}: {what}", found, expected.values[what], expected.scales[what])

    def _expected(self, held: ContactEquations, own: tuple[int, ...]) -> "_Expected | None":
        """Return the answers where the joints `own` move the others; None where no state is suited."""
        q = self.states.q
        rest, rows = [k for k in range(q.shape[1]) if k not in own], held.rows(q)
        clear = far_from_singular(rows, rest)
        clear = clear[steady(held.recursion, q[clear], following(rows[clear], own))][:STATES]
        if not clear.size:
            return None
        given = _Given(self.states.at(clear), list(own), rest)
        condition = condition_of(rows[clear], rest)

        def answers(tree: JointTree) -> dict[str, Array]:
            return _answers(self.equations(held.kind, tree), given)

        values, scales = measure_rounding(answers, self.tree, condition**2)
        return _Expected(given, given.moved(values["velocity"], values["acceleration"]), values, scales)


@dataclass(frozen=True)
class _Expected:
    """Expected answers to a motion, by name, and the scales of their rounding."""

    given: "_Given"
    moved: States
    values: Mapping[str, Array]
    scales: Mapping[str, Array]


class _Given:
    """States of which the motion of the independent joints is given, and which joints these are."""

    def __init__(self, states: States, own: list[int], rest: list[int]) -> None:
        self.states, self.own, self.rest = states, own, rest
        self.tau = np.random.default_rng(8).uniform(-1.0, 1.0, states.q.shape)
        self.yd, self.ydd = states.qd[:, own], states.qdd[:, own]

    def moved(self, qd: Array, qdd: Array) -> States:
        """Return the states with the motion of all joints."""
        return replace(self.states, qd=qd, qdd=qdd)


def _answers(held: ContactEquations, given: _Given) -> dict[str, Array]:
    q, own, rest = given.states.q, given.own, given.rest
    rows = held.rows(q)
    inverse, follows = np.linalg.pinv(rows[..., rest]), following(rows, own)
    qd = (follows @ given.yd[..., None])[..., 0]
    rates = held.rates(q, qd)
    qdd = (follows @ given.ydd[..., None])[..., 0]
    qdd[:, rest] -= (inverse @ rates @ qd[..., None])[..., 0]
    torque, back = held.recursion.partial_torque(q, qd, qdd), np.swapaxes(follows, -1, -2)
    basis = np.linalg.svd(rows[..., rest])[0][..., : len(rest)]
    onto = np.swapaxes(basis, -1, -2)
    states = given.moved(qd, qdd)
    moved, forces = held_motion(held.recursion, states, onto @ rows, onto @ rates, given.tau, own)
    forces = (basis @ forces[..., None])[..., 0]
    return {
        **_of_rows(held, rows, rates, forces),
        "velocity": qd,
        "acceleration": qdd,
        "tau^": with_noise(held.recursion, back @ torque, back, torque),
        "qdd": moved,
    }


def _found(made: Any, held: ContactEquations, moved: States, given: _Given) -> dict[str, Array]:
    """Return a package's answers, named as those of `_answers`."""
    q, qd, qdd = moved.motion
    answer = made.forward_dynamics(q, qd, given.tau, passive=False)
    return {
        **_of_rows(held, made.jacobian(q), made.jacobian_rate(q, qd), answer.forces),
        "velocity": made.velocity(q, given.yd),
        "acceleration": made.acceleration(q, qd, given.ydd),
        "tau^": made.partial_torque(q, qd, qdd),
        "qdd": answer.qdd,
    }


def _of_rows(held: ContactEquations, rows: Array, rates: Array, forces: Array) -> dict[str, Array]:
    """Return the parts of A, its rate and lambda that do not depend on the axes chosen for a hinge's rows."""
    contact = held.own(rows)
    same = slice(contact.start + 2 * (held.kind == "hinged"), contact.stop)
    own = rows[:, contact]
    return {
        "A^T A": np.swapaxes(own, -1, -2) @ own,
        "A": rows[:, same],
        "dA/dt": rates[:, same],
        "A^T lambda": (np.swapaxes(rows, -1, -2) @ forces[..., None])[..., 0],
        "lambda": forces[:, slice(contact.stop - 3, contact.stop)],
    }
