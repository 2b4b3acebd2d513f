"""A back end's answers against an oracle, against their own structure, and against another back end's."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.check.newton_euler import Array, NewtonEuler
from linkwise.check.result import Result, Skipped

TOLERANCE = 1e-9
"""Largest relative error that passes; float64 leaves some 1e-13 for an arm."""

DIFFERENCE_TOLERANCE = 1e-5
"""The same against finite differences of a Lagrangian."""

Answers = Callable[..., Any]
"""A back end: the name of a call and the motion in, arrays out."""


@dataclass(frozen=True)
class Motion:
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


def recursion_oracle(manifest: dict[str, Any], motion: Motion) -> Oracle:
    """Newton-Euler over the manifest's skeleton."""
    recursion, q = NewtonEuler(manifest), motion.q
    columns = [
        recursion.partial_torque(q, 0 * q, np.broadcast_to(unit, q.shape), gravity=False)
        for unit in np.eye(recursion.n)
    ]
    tau = recursion.partial_torque(q, motion.qd, motion.qdd)
    return Oracle("Newton-Euler recursion", TOLERANCE, tau, np.stack(columns, -1))


def difference_oracle(modules: Any, motion: Motion) -> Oracle:
    """Finite differences of the Lagrangians of the autograd back end."""
    from linkwise.check.finite_difference import partial_torque

    tau = partial_torque(modules, motion.q, motion.qd, motion.qdd)
    return Oracle("finite differences of L", DIFFERENCE_TOLERANCE, tau, None)


def against_oracle(name: str, ask: Answers, oracle: Oracle | None, motion: Motion) -> Iterator[Result]:
    """Compare τ_ij, τ_i and M^j with an oracle's."""
    if oracle is None:
        yield Skipped(f"{name}: oracle", "none: energies of a user's own need the autograd back end")
        return
    states = motion.q, motion.qd, motion.qdd
    tau = ask("partial_torque", *states)
    yield _compare(f"{name}: tau_ij against {oracle.name}", tau, oracle.tau, 0.0, oracle.tolerance)
    total = ask("inverse_dynamics", *states)
    sums = oracle.tau.sum(-1)
    yield _compare(f"{name}: tau_i against {oracle.name}", total, sums, 0.0, oracle.tolerance)
    if oracle.mass is not None:
        mass = ask("coefficients", motion.q, motion.qd).acceleration
        yield _compare(
            f"{name}: M^j against {oracle.name}", mass, oracle.mass, motion.scales(oracle.tau)["c2"]
        )


def structure(name: str, ask: Answers, manifest: dict[str, Any], motion: Motion) -> Iterator[Result]:
    """Check what holds for every robot: closure, zeros off the path, and the mass matrix."""
    tau = ask("partial_torque", motion.q, motion.qd, motion.qdd)
    parts = ask("propagation", motion.q, motion.qd, motion.qdd)
    closed = parts.acceleration.sum(-1) + parts.velocity.sum(-1) + parts.gravity
    yield _compare(f"{name}: decomposition closes to tau_ij", closed, tau)
    off = np.ones(tau.shape[1:], dtype=bool)
    for j, link in enumerate(manifest["links"]):
        off[link["path"], j] = False
    error = _largest(tau[:, off])
    yield Result(f"{name}: tau_ij = 0 off the path", error == 0.0, error, f"largest value {error:.1e}")
    mass = ask("coefficients", motion.q, motion.qd).acceleration
    scale = motion.scales(tau)["c2"]
    yield _compare(f"{name}: M^j symmetric", mass, np.swapaxes(mass, 1, 3), scale)
    smallest = float(np.linalg.eigvalsh(mass.sum(2)).min())
    unphysical = bool(manifest["request"].get("allow_unphysical")) or manifest["skeleton"] is None
    detail = f"smallest eigenvalue {smallest:.1e}"
    yield Result(f"{name}: total mass matrix positive definite", smallest > 0 or unphysical, smallest, detail)


def agreement(name: str, one: Answers, other_name: str, other: Answers, motion: Motion) -> Iterator[Result]:
    """Compare every answer of two back ends."""
    states = motion.q, motion.qd, motion.qdd
    against = f"{name} against {other_name}"
    tau, reference = one("partial_torque", *states), other("partial_torque", *states)
    yield _compare(f"{against}: tau_ij", tau, reference)
    scales = motion.scales(reference)
    a, b = one("coefficients", *states[:2]), other("coefficients", *states[:2])
    for what, x, y in zip(("c2", "c1", "g"), a, b, strict=False):
        yield _compare(f"{against}: {what}", x, y, scales[what])
    a, b = one("position_gradient", *states), other("position_gradient", *states)
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
