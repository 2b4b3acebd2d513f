"""Contacts of each kind, as a back end answers for them, against `contact_equations` and least squares.

The two rows of a hinge's turns stand along axes that are the package's choice: A^T A and A^T lambda of them
are compared.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from linkwise.check.compare import Entries, Result, compare
from linkwise.check.contact_equations import KINDS, ContactEquations
from linkwise.check.loop_checks import loop_entries
from linkwise.check.loop_equations import RANK, LoopEquations
from linkwise.check.loop_reference import FAR, held_motion, steady
from linkwise.check.newton_euler import NewtonEuler
from linkwise.check.states import States
from linkwise.package.entries import RigidTree
from linkwise.package.load import Array, Model
from linkwise.package.manifest import Manifest

STATES = 2
TRIED = 6


def contact_calls(
    name: str, model: Model, manifest: Manifest, tree: RigidTree, states: States, contact: Callable[..., Any]
) -> Iterator[Result]:
    """Of the frame that most joints move, one result for all kinds; states: in which ties close.

    contact: the package's own record
    """
    recursion = NewtonEuler(manifest, tree)
    frame = max((f for f in tree.frames if f.body is not None), key=lambda f: _depth(tree, f.body))
    ties = LoopEquations(recursion, tree) if tree.tied else None
    entries: list[Entries] = []
    for kind in KINDS:
        held = ContactEquations(recursion, ties, frame, kind)
        entries += _of_one(model, held, states.at(slice(0, TRIED)), contact)
    if entries:
        yield compare(f"{name}: contacts against least squares", entries)


def _depth(tree: RigidTree, body: int | None) -> int:
    return 0 if body is None else 1 + _depth(tree, tree.bodies[body].parent)


def _of_one(
    model: Any, held: ContactEquations, states: States, contact: Callable[..., Any]
) -> Iterator[Entries]:
    """Entries of one kind; none where it leaves nothing to move, or at no state enough."""
    rows = held.rows(states.q)
    values = np.linalg.svd(rows, compute_uv=False)
    if (values > RANK * np.maximum(values[:, :1], 1.0)).sum(-1).max() == states.q.shape[1]:
        return
    made = model.constrained(contacts=[contact(**held.asked)])
    own = [model.joint_names.index(name) for name in made.independent]
    rest = [k for k in range(states.q.shape[1]) if k not in own]
    sizes = np.linalg.svd(rows[..., rest], compute_uv=False)
    clear = np.flatnonzero(sizes[:, -1] > FAR * sizes[:, 0])
    if clear.size:
        clear = clear[steady(held.recursion, states.q[clear], _mapped(rows[clear], own, rest))][:STATES]
        yield from _compared(made, held, states.at(clear), own, rest)


def _mapped(rows: Array, own: list[int], rest: list[int]) -> Array:
    """G (samples, n, m)."""
    found = np.zeros((len(rows), rows.shape[2], len(own)))
    found[:, own], found[:, rest] = np.eye(len(own)), -np.linalg.pinv(rows[..., rest]) @ rows[..., own]
    return found


def _compared(
    made: Any, held: ContactEquations, states: States, own: list[int], rest: list[int]
) -> Iterator[Entries]:
    q, yd, ydd = states.q, states.qd[:, own], states.qdd[:, own]
    rows = held.rows(q)
    inverse, follows = np.linalg.pinv(rows[..., rest]), _mapped(rows, own, rest)
    qd = (follows @ yd[..., None])[..., 0]
    rates = held.rates(q, qd)
    qdd = (follows @ ydd[..., None])[..., 0]
    qdd[:, rest] -= (inverse @ rates @ qd[..., None])[..., 0]
    what, contact, found = f"{held.kind}: ", held.own(rows), made.jacobian(q)
    yield loop_entries(what + "A^T A", _square(found[:, contact]), _square(rows[:, contact]))
    same = slice(contact.start + 2 * (held.kind == "hinged"), contact.stop)
    yield loop_entries(what + "A", found[:, same], rows[:, same])
    yield loop_entries(what + "dA/dt", made.jacobian_rate(q, qd)[:, same], rates[:, same])
    yield loop_entries(what + "velocity", made.velocity(q, yd), qd)
    yield loop_entries(what + "acceleration", made.acceleration(q, qd, ydd), qdd)
    torque, back = held.recursion.partial_torque(q, qd, qdd), np.swapaxes(follows, -1, -2)
    yield loop_entries(what + "tau^", made.partial_torque(q, qd, qdd), back @ torque)
    tau = np.random.default_rng(8).uniform(-1.0, 1.0, q.shape)
    basis = np.linalg.svd(rows[..., rest])[0][..., : len(rest)]
    onto = np.swapaxes(basis, -1, -2)
    moved, forces = held_motion(held.recursion, replace(states, qd=qd), onto @ rows, onto @ rates, tau)
    answer = made.forward_dynamics(q, qd, tau, passive=False)
    yield loop_entries(what + "qdd", answer.qdd, moved)
    forces = (basis @ forces[..., None])[..., 0]
    size = float(np.abs(forces).max(initial=0.0))
    yield loop_entries(what + "A^T lambda", _borne(found, answer.forces), _borne(rows, forces), size)
    shifts = slice(contact.stop - 3, contact.stop)
    yield loop_entries(what + "lambda", answer.forces[:, shifts], forces[:, shifts], size)


def _square(rows: Array) -> Array:
    return np.swapaxes(rows, -1, -2) @ rows


def _borne(rows: Any, forces: Any) -> Any:
    return (np.swapaxes(rows, -1, -2) @ forces[..., None])[..., 0]
