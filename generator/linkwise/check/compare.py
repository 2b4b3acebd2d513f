"""A back end's answers against an oracle, against their own structure, and against another back end's."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.check.finite_difference import partial_torque
from linkwise.check.newton_euler import NewtonEuler
from linkwise.package.load import Array, Model
from linkwise.package.manifest import Manifest

TOLERANCE = 1e-9
"""Largest relative error that passes; float64 leaves some 1e-13 for an arm."""

DIFFERENCE_TOLERANCE = 1e-5
"""The same against finite differences of a Lagrangian."""


@dataclass(frozen=True)
class Result:
    """One check: its name, whether it passed, the largest error (None: not a number's matter), and a line."""

    name: str
    passed: bool
    error: float | None
    detail: str

    @property
    def mark(self) -> str:
        """Return ok, FAIL or skip."""
        return "ok" if self.passed else "FAIL"


class Skipped(Result):
    """A check that could not be made here, which speaks neither for the package nor against it."""

    def __init__(self, name: str, detail: str) -> None:
        super().__init__(name, True, None, detail)

    @property
    def mark(self) -> str:
        """Return skip."""
        return "skip"


@dataclass(frozen=True)
class States:
    """The states of all checks, each array (samples, n)."""

    q: Array
    qd: Array
    qdd: Array

    def scales(self, tau: Array) -> dict[str, float]:
        """How large a coefficient is that makes torques as large as `tau` of this motion.

        A coefficient that is 0 but for rounding has no scale of its own: errors are relative to this one.
        """
        torque = _largest(tau)
        c2, c1, c0 = (torque / max(_largest(x), 1e-300) for x in (self.qdd, self.qd, self.q))
        return {"c2": c2, "c1": c1, "c0": c0, "g": torque}


@dataclass(frozen=True)
class Oracle:
    """Partial torques, and the links' mass matrices where the oracle knows them."""

    name: str
    tolerance: float
    tau: Array
    mass: Array | None


def recursion_oracle(recursion: NewtonEuler, states: States) -> Oracle:
    """Newton-Euler over the manifest's rigid bodies."""
    q = states.q
    columns = [
        recursion.partial_torque(q, 0 * q, np.broadcast_to(unit, q.shape), gravity=False)
        for unit in np.eye(recursion.n)
    ]
    tau = recursion.partial_torque(q, states.qd, states.qdd)
    return Oracle("Newton-Euler recursion", TOLERANCE, tau, np.stack(columns, -1))


def difference_oracle(modules: Any, states: States) -> Oracle:
    """Finite differences of the Lagrangians of the autograd back end."""
    tau = partial_torque(modules, states.q, states.qd, states.qdd)
    return Oracle("finite differences of L", DIFFERENCE_TOLERANCE, tau, None)


def against_oracle(name: str, model: Model, oracle: Oracle | None, states: States) -> Iterator[Result]:
    """Compare τ_ij, τ_i and M^j with an oracle's."""
    if oracle is None:
        yield Skipped(f"{name}: oracle", "none: energies of a user's own need the autograd back end")
        return
    motion = states.q, states.qd, states.qdd
    tau = model.partial_torque(*motion)
    yield _compare(f"{name}: tau_ij against {oracle.name}", tau, oracle.tau, 0.0, oracle.tolerance)
    total = model.inverse_dynamics(*motion)
    sums = oracle.tau.sum(-1)
    yield _compare(f"{name}: tau_i against {oracle.name}", total, sums, 0.0, oracle.tolerance)
    if oracle.mass is not None:
        mass = model.coefficients(states.q, states.qd).acceleration
        yield _compare(
            f"{name}: M^j against {oracle.name}", mass, oracle.mass, states.scales(oracle.tau)["c2"]
        )


def structure(name: str, model: Model, manifest: Manifest, states: States) -> Iterator[Result]:
    """Check what holds for every robot: closure, zeros off the path, and the mass matrix."""
    tau = model.partial_torque(states.q, states.qd, states.qdd)
    parts = model.propagation(states.q, states.qd, states.qdd)
    closed = parts.acceleration.sum(-1) + parts.velocity.sum(-1) + parts.gravity
    yield _compare(f"{name}: decomposition closes to tau_ij", closed, tau)
    off = np.ones(tau.shape[1:], dtype=bool)
    for j, link in enumerate(manifest.links):
        off[list(link.path), j] = False
    error = _largest(tau[:, off])
    yield Result(f"{name}: tau_ij = 0 off the path", error == 0.0, error, f"largest value {error:.1e}")
    mass = model.coefficients(states.q, states.qd).acceleration
    scale = states.scales(tau)["c2"]
    yield _compare(f"{name}: M^j symmetric", mass, np.swapaxes(mass, 1, 3), scale)
    smallest = float(np.linalg.eigvalsh(mass.sum(2)).min())
    unphysical = bool(manifest.request.get("allow_unphysical")) or manifest.tree is None
    detail = f"smallest eigenvalue {smallest:.1e}"
    yield Result(f"{name}: total mass matrix positive definite", smallest > 0 or unphysical, smallest, detail)


def agreement(name: str, one: Model, other_name: str, other: Model, states: States) -> Iterator[Result]:
    """Compare every answer of two back ends."""
    motion = states.q, states.qd, states.qdd
    against = f"{name} against {other_name}"
    tau, reference = one.partial_torque(*motion), other.partial_torque(*motion)
    yield _compare(f"{against}: tau_ij", tau, reference)
    scales = states.scales(reference)
    a, b = one.coefficients(*motion[:2]), other.coefficients(*motion[:2])
    for what, x, y in zip(("c2", "c1", "g"), a, b, strict=False):
        yield _compare(f"{against}: {what}", x, y, scales[what])
    a, b = one.position_gradient(*motion), other.position_gradient(*motion)
    yield _compare(f"{against}: c0", a, b, scales["c0"])


def _compare(
    name: str, value: Array, reference: Array, floor: float = 0.0, tolerance: float = TOLERANCE
) -> Result:
    """Compare relative to the largest value, or to `floor` where all values are smaller."""
    if np.shape(value) != np.shape(reference):
        return Result(name, False, None, f"shape {np.shape(value)} instead of {np.shape(reference)}")
    error = _largest(value - reference) / max(_largest(reference), floor, 1e-300)
    return Result(name, bool(error <= tolerance), error, f"largest relative error {error:.1e}")


def _largest(value: Array) -> float:
    return float(np.abs(value).max(initial=0.0))
