"""Measured time of deriving an arm with one more link: the whole Lagrangian anew, or only that link's.

    D_i = Σ_s (q̇_s ∂²/∂q̇_i∂q_s + q̈_s ∂²/∂q̇_i∂q̇_s) − ∂/∂q_i,      L = Σ_j L_j

SymPy derives D_i L, or D_i L_n of the last link n alone, for all joints i, and expands it: only expanded
terms show which motion they contain. Each derivation runs in a process of its own, which is ended at its
time limit.
"""

import multiprocessing
import time
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection

import sympy as sp

from linkwise.dynamics.derive import link_forms
from linkwise.progress import Progress
from linkwise.report.expanded_arm import expanded_arm
from linkwise.report.trigonometric_ring import TrigonometricRing
from linkwise.robot import Coordinate
from linkwise.symbolic.system import EnergySystem, System

LIMIT = 20.0
"""Time limit in s for one derivation by SymPy."""
BUDGET = 10_000
"""Most terms of a velocity component: SymPy could not derive larger ones in time."""


@dataclass(frozen=True)
class DerivationTime:
    """Processor seconds to derive the first `dof` links when the last is new; None: not within the limit.

    whole: D_i ΣL_j by SymPy      link: D_i L_n by SymPy      rule: closed forms of link n by linkwise
    """

    dof: int
    whole: float | None
    link: float | None
    rule: float


def measure_derivations(
    system: System, dof: Sequence[int], progress: Progress, limit: float = LIMIT
) -> tuple[DerivationTime, ...]:
    """Return the times of a serial arm for each n of `dof`, ascending.

    SymPy stops at the first n beyond the limit.
    """
    lagrangians = _lagrangians(system, dof[-1])
    whole: float | None = 0.0
    link: float | None = 0.0
    times: list[DerivationTime] = []
    for n in dof:
        moving = system.coordinates[:n]
        if n > len(lagrangians):
            whole = link = None
        if whole is not None:
            whole = _bounded(sp.Add(*lagrangians[:n], evaluate=False), moving, limit)
        if link is not None:
            link = _bounded(lagrangians[n - 1], moving, limit)
        started = time.process_time()
        link_forms(system, n - 1)
        times.append(DerivationTime(n, whole, link, time.process_time() - started))
        progress("derive by SymPy", len(times), len(dof))
    return tuple(times)


def _lagrangians(system: System, links: int) -> list[sp.Expr]:
    """Return L_j of the first links; of rigid links as in textbooks, by velocities in the world's axes."""
    if isinstance(system, EnergySystem):
        return [link.kinetic - link.potential for link in system.links[:links]]
    arm = expanded_arm(system, links, BUDGET)
    terms = TrigonometricRing(arm)
    gravity = sp.Matrix([terms.expression(a) for a in arm.gravity])
    found = []
    for body in arm.bodies:
        place, turning = (sp.Matrix([terms.expression(a) for a in v]) for v in (body.place, body.turning))
        mass = terms.expression(body.mass)
        inertia = sp.Matrix([[terms.expression(a) for a in row] for row in body.inertia])
        speed = sum((place.diff(c.q) * c.qd for c in system.coordinates), sp.zeros(3, 1))
        kinetic = (mass * speed.dot(speed) + turning.dot(inertia * turning)) / 2
        found.append(kinetic + mass * gravity.dot(place))
    return found


def _bounded(lagrangian: sp.Expr, moving: Sequence[Coordinate], limit: float) -> float | None:
    """Return the seconds that SymPy takes in a separate process; None where it exceeds the limit."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=_derive, args=(lagrangian, tuple(moving), there), daemon=True)
    process.start()
    there.close()
    try:
        here.recv()  # the process is ready: importing SymPy is not counted
        return float(here.recv()) if here.poll(limit) else None
    finally:
        process.kill()
        process.join()


def _derive(lagrangian: sp.Expr, moving: Sequence[Coordinate], answer: Connection) -> None:
    """Send a message when ready, then the seconds that all D_i L took."""
    answer.send("ready")
    started = time.process_time()
    for joint in moving:
        sp.expand(_torque(lagrangian, joint, moving))
    answer.send(time.process_time() - started)


def _torque(lagrangian: sp.Expr, joint: Coordinate, moving: Sequence[Coordinate]) -> sp.Expr:
    """Return D_i L."""
    momentum = sp.diff(lagrangian, joint.qd)
    rates = (sp.diff(momentum, c.q) * c.qd + sp.diff(momentum, c.qd) * c.qdd for c in moving)
    return sp.Add(*rates) - sp.diff(lagrangian, joint.q)
