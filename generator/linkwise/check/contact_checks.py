"""Contacts of each kind, as a back end answers for them, against `contact_equations` and least squares.

The two rows of a hinge's turns stand along axes that are the package's choice: A^T A and A^T lambda of them
are compared.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from linkwise_runtime.dynamics import Dynamics

from linkwise.check.compare import Entries, Result, compare, skipped
from linkwise.check.contact_equations import KINDS, ContactEquations
from linkwise.check.held_motion import condition_of, far_from_singular, held_motion, steady, with_noise
from linkwise.check.loop_equations import LoopEquations, following
from linkwise.check.newton_euler import NewtonEuler
from linkwise.check.rounding import measured
from linkwise.check.states import States
from linkwise.package.entries import RigidTree
from linkwise.package.load import Array
from linkwise.package.manifest import Manifest

STATES = 2
TRIED = 6


class HeldContacts:
    """Contacts of each kind on the frame that most joints move, at states in which ties close."""

    def __init__(self, manifest: Manifest, tree: RigidTree, states: States) -> None:
        at = max((f for f in tree.frames if f.body is not None), key=lambda f: _depth(tree, f.body))
        self.manifest, self.tree, self.frame = manifest, tree, tree.frames.index(at)
        self.states = states.at(slice(0, TRIED))
        self._kept: dict[tuple[str, tuple[int, ...]], _Expected | None] = {}

    def calls(self, name: str, model: Dynamics, contact: Callable[..., Any]) -> Iterator[Result]:
        """One result of a back end for all kinds; contact: the package's own record."""
        kinds = [kind for kind in KINDS if self._leaves_freedom(kind)]
        entries = [entry for kind in kinds for entry in self._compared(model, kind, contact)]
        if not kinds:
            return
        if entries:
            yield compare(f"{name}: contacts against least squares", entries)
        else:
            told = "each is next to a singular position, or to a singular mass matrix, at every state"
            yield skipped(f"{name}: contacts", told)

    def equations(self, kind: str, tree: RigidTree) -> ContactEquations:
        """Those of a tree, which may be a noisy one."""
        recursion = NewtonEuler(self.manifest, tree)
        ties = LoopEquations(recursion, tree) if tree.tied else None
        return ContactEquations(recursion, ties, tree.frames[self.frame], kind)

    def _leaves_freedom(self, kind: str) -> bool:
        """Whether joints can move under a contact of this kind."""
        return bool(self.equations(kind, self.tree).freedoms(self.states.q).min() > 0)

    def _compared(self, model: Any, kind: str, contact: Callable[..., Any]) -> Iterator[Entries]:
        """Entries of one kind; none where it is far enough from singular positions at no state."""
        held = self.equations(kind, self.tree)
        made = model.constrained(contacts=[contact(**held.asked)])
        own = tuple(model.joint_names.index(name) for name in made.independent)
        if (kind, own) not in self._kept:
            self._kept[kind, own] = self._expected(held, own)
        expected = self._kept[kind, own]
        if expected is not None:
            for what, found in _found(made, held, expected.moved, expected.given).items():
                yield Entries(f"{kind}: {what}", found, expected.values[what], expected.scales[what])

    def _expected(self, held: ContactEquations, own: tuple[int, ...]) -> "_Expected | None":
        """The answers, where these joints move the others."""
        q = self.states.q
        rest, rows = [k for k in range(q.shape[1]) if k not in own], held.rows(q)
        clear = far_from_singular(rows, rest)
        clear = clear[steady(held.recursion, q[clear], following(rows[clear], own))][:STATES]
        if not clear.size:
            return None
        given = _Given(self.states.at(clear), list(own), rest)
        condition = condition_of(rows[clear], rest)

        def answers(tree: RigidTree) -> dict[str, Array]:
            return _answers(self.equations(held.kind, tree), given)

        values, scales = measured(answers, self.tree, condition**2)
        return _Expected(given, given.moved(values["velocity"], values["acceleration"]), values, scales)


def _depth(tree: RigidTree, body: int | None) -> int:
    return 0 if body is None else 1 + _depth(tree, tree.bodies[body].parent)


@dataclass(frozen=True)
class _Expected:
    """Answers to a motion by name, and the scales of their rounding."""

    given: "_Given"
    moved: States
    values: Mapping[str, Array]
    scales: Mapping[str, Array]


class _Given:
    """States, of which the independent joints' motion counts, and which joints these are."""

    def __init__(self, states: States, own: list[int], rest: list[int]) -> None:
        self.states, self.own, self.rest = states, own, rest
        self.tau = np.random.default_rng(8).uniform(-1.0, 1.0, states.q.shape)
        self.yd, self.ydd = states.qd[:, own], states.qdd[:, own]

    def moved(self, qd: Array, qdd: Array) -> States:
        """The motion of all joints."""
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
    """The same of a package."""
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
    """What of A, its rate and lambda does not depend on the axes that a hinge's rows stand along."""
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
