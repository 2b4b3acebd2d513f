"""Reference for constraints that a user wrote, from their text in a manifest and that of the energies.

torch differentiates phi and A. With N an orthonormal basis of the null space of A, of coordinates measured by
sqrt(M_ii), M qdd + h = tau + A^T lambda and A qdd = -dA/dt qd give (N^T M N) z = N^T (tau - h - M p) for
qdd = N z + p, p = -A^+ dA/dt qd; lambda is what A^T lambda fits best.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from linkwise.arrays import Array
from linkwise.extras import extra
from linkwise.oracle.energies import Terms, TextValues, quantities_of
from linkwise.oracle.formula_text import TextFormula
from linkwise.oracle.held_motion import condition_of, far_from_singular, motions, unit_sizes
from linkwise.oracle.loop_equations import following
from linkwise.oracle.loop_reference import SMALL, STATES, TRIED, LoopReference
from linkwise.oracle.noisy_numbers import NOISE
from linkwise.oracle.states import States
from linkwise.package.entries import EnergiesEntry

STEPS = 60
SETTLED = 1e-13
"""Steps below this, for positions of size 1, have come to where constraints hold."""
CLOSED = 1e-9
LONGEST = 0.5
HEAVY = 1e-6
"""Least eigenvalue of G^T M G with ones on its diagonal: below, joints can move together without mass."""


class TextConstraints:
    """Constraints of a manifest; raises Unreadable for text that is no formula.

    noise: a seed for errors of up to NOISE in each operation, the same ones in each call; None for none
    """

    def __init__(
        self,
        written: EnergiesEntry,
        joints: Sequence[str],
        parameters: Mapping[str, float],
        noise: int | None = None,
    ) -> None:
        self._values = TextValues(parameters, written.time, noise)
        self._formulas = [(TextFormula(one.expression), one.holonomic) for one in written.constraints]
        self.holonomic = all(one.holonomic for one in written.constraints)
        self.independent = written.independent
        self.dependent = [k for k in range(len(joints)) if k not in written.independent]

    def violation(self, q: Array) -> Array:
        """Return phi (samples, C)."""
        return self._mapped(self._phi, q)

    def rows(self, q: Array) -> Array:
        """Return A (samples, C, n)."""
        return self._mapped(self._rows, q)

    def rates(self, q: Array, qd: Array) -> Array:
        """Return dA/dt (samples, C, n)."""

        def rate(at: Any, moved: Any) -> Any:
            return extra("torch").func.jacrev(self._rows)(at) @ moved

        return self._mapped(rate, q, qd)

    def sizes(self, q: Array) -> Array:
        """Return what rows are divided by (samples, C): their largest slope."""
        most: Array = np.abs(self.rows(q)).max(-1)
        return np.where(most > 0.0, most, 1.0)

    def closed_near(self, q: Array) -> Array:
        """Return positions to which steps of least norm lead; starts that lead to none are left out."""
        found, size = q.copy(), np.full(len(q), np.inf)
        for _ in range(STEPS):
            sizes = self.sizes(found)
            rows, left = self.rows(found) / sizes[..., None], self.violation(found) / sizes
            step = -(np.linalg.pinv(rows, rcond=SMALL) @ left[..., None])[..., 0]
            size = np.abs(step).max(-1)
            if not (size >= SETTLED * (1.0 + np.abs(found).max(-1))).any():
                break
            found += step * (LONGEST / np.maximum(size, LONGEST))[:, None]
        closed: Array = found[(np.abs(self.violation(found) / self.sizes(found)).max(-1) < CLOSED)]
        return closed

    def _phi(self, q: Any) -> Any:
        zero = q.new_zeros(())
        found = [self._value(one, q, 0.0 * q) if is_phi else zero for one, is_phi in self._formulas]
        return extra("torch").stack(found)

    def _rows(self, q: Any) -> Any:
        func, rest = extra("torch").func, 0.0 * q
        rows = [
            func.grad(lambda x, one=one: self._value(one, x, rest))(q)
            if is_phi
            else func.grad(lambda v, one=one: self._value(one, q, v))(rest)
            for one, is_phi in self._formulas
        ]
        return extra("torch").stack(rows)

    def _value(self, formula: TextFormula, q: Any, qd: Any) -> Any:
        # A formula without a coordinate still has a gradient, of zeros.
        return self._values.value(formula, q, qd, self._values.now) + 0.0 * (q.sum() + qd.sum())

    def _shape(self, function: Callable[..., Any]) -> tuple[int, ...]:
        count, n = len(self._formulas), len(self.independent) + len(self.dependent)
        return (count,) if function == self._phi else (count, n)

    def _mapped(self, function: Callable[..., Any], *motion: Array) -> Array:
        torch = extra("torch")
        if not len(motion[0]):
            return np.zeros((0, *self._shape(function)))
        found: Array = torch.func.vmap(function)(*(torch.from_numpy(a) for a in motion)).numpy()
        return found


def written_reference(
    ties: Sequence[TextConstraints],
    terms: Sequence[Terms],
    names: Sequence[str],
    position: Array,
    states: States,
) -> LoopReference | None:
    """Return the answers where constraints hold; None where none of the states leads there.

    ties, terms: exact ones, then the same with errors in each operation; names: of the shares, in order
    position: one where constraints hold, (n,)
    """
    exact = ties[0]
    own, rest = list(exact.independent), exact.dependent
    tried = states.q[:TRIED]
    starts = [tried, *(position + tried * part for part in (0.5, 0.1, 0.02))]
    q = exact.closed_near(np.concatenate(starts))
    q = q[far_from_singular(_scaled(exact, q)[0], rest)]
    q = q[_heavy(terms[0], names, q, following(_scaled(exact, q)[0], own))][: min(STATES, len(states.q))]
    if not len(q):
        return None
    yd, ydd = states.qd[: len(q), own], states.qdd[: len(q), own]
    tau = np.random.default_rng(5).uniform(-1.0, 1.0, q.shape)
    values = _answers(exact, terms[0], names, (q, yd, ydd), tau)
    scales = {what: np.abs(value).reshape(len(q), -1).max(-1) for what, value in values.items()}
    for one, other in zip(ties[1:], terms[1:], strict=True):
        for what, changed in _answers(one, other, names, (q, yd, ydd), tau).items():
            moved = np.abs(changed - values[what]).reshape(len(q), -1).max(-1) / NOISE
            scales[what] = np.maximum(scales[what], moved)
    lost = condition_of(_scaled(exact, q)[0], rest) ** 2
    spread = {
        what: np.broadcast_to((scale * lost).reshape(-1, *[1] * (values[what].ndim - 1)), values[what].shape)
        for what, scale in scales.items()
    }
    moved = States(q, values["velocity"], values["acceleration"])
    return LoopReference(exact, exact.independent, moved, tau, values, spread, exact.holonomic)


def followed(ties: TextConstraints, q: Array, v: Array) -> tuple[Array, Array]:
    """Return q (1, n) with its dependent joints moved until constraints hold, and qd for v (1, m)."""
    q, rest = q.copy(), ties.dependent
    for _ in range(STEPS):
        held, sizes = _scaled(ties, q)
        step = (np.linalg.pinv(held[..., rest], rcond=SMALL) @ (ties.violation(q)[..., None] / sizes))[..., 0]
        q[:, rest] -= step
        if np.abs(step).max() < SETTLED:
            break
    return q, (following(_scaled(ties, q)[0], ties.independent) @ v[..., None])[..., 0]


def held_acceleration(ties: TextConstraints, q: Array, qd: Array, mass: Array, force: Array) -> Array:
    """Return ydd (1, m) at q and qd, under a mass matrix (1, n, n) and forces tau - h (1, n)."""
    held, sizes = _scaled(ties, q)
    change = (ties.rates(q, qd) / sizes) @ qd[..., None]
    moved: Array = _moved(mass, held, ties.dependent, force[..., None], change)[0][
        :, list(ties.independent), 0
    ]
    return moved


def _scaled(ties: TextConstraints, q: Array) -> tuple[Array, Array]:
    """Return A with rows divided by their sizes, and the sizes (samples, C, 1)."""
    sizes = ties.sizes(q)[..., None]
    return ties.rows(q) / sizes, sizes


def _heavy(terms: Terms, names: Sequence[str], q: Array, mapped: Array) -> Any:
    """Return at which positions no motion that constraints allow is without mass."""
    if not len(q):
        return np.zeros(0, dtype=bool)
    rest = 0.0 * q
    mass = quantities_of(terms, names, States(q, rest, rest))["c2"].sum(2)
    own = np.swapaxes(mapped, -1, -2) @ mass @ mapped
    size = unit_sizes(own)
    return np.linalg.eigvalsh(own / (size[:, :, None] * size[:, None, :]))[:, 0] > HEAVY


def _answers(
    ties: TextConstraints, terms: Terms, names: Sequence[str], motion: tuple[Array, ...], tau: Array
) -> dict[str, Array]:
    """Return all answers of a package to q, yd and ydd, and to torques, by name."""
    (q, yd, ydd), own, rest = motion, list(ties.independent), ties.dependent
    held, sizes = _scaled(ties, q)
    mapped = following(held, own)
    inverse = np.zeros((len(q), q.shape[1], held.shape[1]))
    inverse[:, rest] = np.linalg.pinv(held[..., rest], rcond=SMALL)
    qd = (mapped @ yd[..., None])[..., 0]
    rates = ties.rates(q, qd)
    bias = -(inverse @ (rates / sizes) @ qd[..., None])[..., 0]
    qdd = (mapped @ ydd[..., None])[..., 0] + bias
    of_links = quantities_of(terms, names, States(q, qd, qdd))
    torque, c2, c1, g = (of_links[what] for what in ("tau", "c2", "c1", "g"))
    turning = -inverse @ (rates / sizes) @ mapped
    shares = np.einsum("sia,sij->saj", mapped, torque)
    mass, rest_torque = c2.sum(2), torque.sum(2) - np.einsum("sijk,sk->si", c2, qdd)
    sources = {
        "actuators": np.eye(q.shape[1]) * tau[:, None, :],
        "velocity": -c1 * qd[:, None, None, :],
        "gravity": -g,
        "constraints": np.zeros((*q.shape, q.shape[1])),
    }
    total = tau - rest_torque
    moved, forces = _moved(mass, held, rest, total[..., None], (rates / sizes) @ qd[..., None])
    found = {
        "violation": ties.violation(q),
        "jacobian": held * sizes,
        "jacobian_rate": rates,
        "velocity_map": mapped,
        "velocity": qd,
        "acceleration": qdd,
        "velocity_accelerations": bias,
        "projected": (np.swapaxes(mapped, -1, -2) @ tau[..., None])[..., 0],
        "tau^": shares,
        "sum of tau^": shares.sum(-1),
        "c2^": np.einsum("sia,sijk,skb->sajb", mapped, c2, mapped),
        "c1^": np.einsum("sia,sijb->sajb", mapped, _times(c2, turning) + _times(c1, mapped)),
        "g^": np.einsum("sia,sij->saj", mapped, g),
        "lambda of links": np.linalg.pinv(np.swapaxes(held[..., rest], -1, -2), rcond=SMALL)
        @ torque[:, rest]
        / sizes,
        "qdd": moved[..., 0],
        "lambda": (forces / sizes)[..., 0],
    }
    for source, force in sources.items():
        flat = force.reshape(*force.shape[:2], -1)
        is_own = source == "constraints"
        own_rate = (rates / sizes) * qd[:, None, :] if is_own else 0.0 * (held @ flat)
        induced, reactions = _moved(mass, held, rest, flat, own_rate)
        found[f"{source}: accelerations"] = induced.reshape(force.shape)
        found[f"{source}: reactions"] = (reactions / sizes).reshape(len(q), -1, *force.shape[2:])
    return found


def _moved(
    mass: Array, rows: Array, rest: Sequence[int], force: Array, bias_rate: Array
) -> tuple[Array, Array]:
    """Return accelerations (samples, n, X) and lambda (samples, C, X) of forces (samples, n, X).

    bias_rate: what the rows times accelerations come to, with the other sign, (samples, C, X)
    """
    # Rows that follow from others take no freedom away: those of U^T A are as many as the rank.
    basis = np.linalg.svd(rows[..., rest])[0][..., : len(rest)]
    null = motions(mass, np.swapaxes(basis, -1, -2) @ rows)
    back = np.swapaxes(null, -1, -2)
    own = -np.linalg.pinv(rows, rcond=SMALL) @ bias_rate
    moved = null @ np.linalg.solve(back @ mass @ null, back @ (force - mass @ own)) + own
    return moved, np.linalg.pinv(np.swapaxes(rows, -1, -2), rcond=SMALL) @ (mass @ moved - force)


def _times(cube: Array, matrix: Array) -> Array:
    product: Array = np.einsum("sijk,skb->sijb", cube, matrix)
    return product
