"""Particles and rigid bodies by where they are: their velocities, and so their energies, follow."""

import random
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
import sympy as sp
from linkwise_runtime.structure import GRAVITY
from sympy.core.function import AppliedUndef
from sympy.simplify.fu import TR5, TR6

from linkwise.errors import LinkwiseError
from linkwise.escape import short
from linkwise.symbolic.energy_terms import expression_of
from linkwise.symbolic.system import POTENTIAL, Forces, LinkEnergy, Named

Rate: TypeAlias = Callable[[sp.Expr], sp.Expr]
"""Function that returns the time derivative of an expression in coordinates and time."""
Values: TypeAlias = Mapping[sp.Symbol, float]
"""Values of parameters."""
ZERO = sp.S.Zero
ROUNDED = 1e-6
"""Relative error of a rotation or an inertia: numbers may be written with seven digits."""


@dataclass(frozen=True)
class Particle:
    """A point mass: K = m ṙ·ṙ/2.

    mass: in kg
    position: r, its two or three components in m, in axes that stand still
    gravity: of its field in m/s², as many components, along the same axes; the potential −m g·r is its share
    `gravity`
    potential, dissipation, forces: as in `LinkEnergy`, beside these
    """

    name: str
    mass: sp.Expr
    position: Sequence[sp.Expr]
    gravity: Sequence[sp.Expr] = ()
    potential: sp.Expr | Named = ZERO
    dissipation: sp.Expr | Named = ZERO
    forces: Forces = field(default_factory=dict)

    def energies(self, rate: Rate, values: Values) -> LinkEnergy:
        """Return the energies; raise LinkwiseError for what is no mass, place or field."""
        mass, place = _mass(self.mass, values), _vector("position", self.position, (2, 3))
        return _link(self, mass * _square(rate(x) for x in place) / 2, mass, place)


@dataclass(frozen=True)
class RigidBody:
    """A rigid body: K = m ṙ·ṙ/2 + ω·I ω/2, with ω in its own axes from RᵀṘ.

    mass: in kg
    position: r of its centre of mass, three components in m, in axes that stand still
    rotation: R, three rows: the columns are the body's own axes in those that stand still
    inertia: I about the centre of mass in kg m², along the own axes: three principal ones, or three rows
    gravity: in m/s², as of `Particle`
    potential, dissipation, forces: as in `LinkEnergy`, beside these
    """

    name: str
    mass: sp.Expr
    position: Sequence[sp.Expr]
    rotation: Any
    inertia: Any
    gravity: Sequence[sp.Expr] = ()
    potential: sp.Expr | Named = ZERO
    dissipation: sp.Expr | Named = ZERO
    forces: Forces = field(default_factory=dict)

    def energies(self, rate: Rate, values: Values) -> LinkEnergy:
        """Return the energies; raise LinkwiseError for what is no mass, place, rotation, inertia or field."""
        mass, place = _mass(self.mass, values), _vector("position", self.position, (3,))
        turned, inertia = _matrix("rotation", self.rotation), _inertia(self.inertia)
        _check_rotation(turned, values)
        _check_inertia(inertia, values)
        turning = turned.applyfunc(rate)
        # omega along the own axes: the entries (3, 2), (1, 3) and (2, 1) of R^T dR/dt
        omega = sp.Matrix([_shorter(turned[:, i].dot(turning[:, k])) for i, k in ((2, 1), (0, 2), (1, 0))])
        moving = mass * _square(rate(x) for x in place) / 2
        return _link(self, moving + (omega.T * inertia * omega)[0] / 2, mass, place)


BODIES = (Particle, RigidBody)
"""Kinds of links that are given by where they are."""


def _square(velocity: Iterable[sp.Expr]) -> sp.Expr:
    """Return v·v, such that of what turns no angle is left."""
    return _shorter(sum((component**2 for component in velocity), ZERO))


def _shorter(given: sp.Expr) -> sp.Expr:
    """Return a sum without sin² + cos² where that is shorter.

    With cos² for 1 - sin², or the other way round, whatever cancels does: sp.simplify needs hundreds of times
    as long to find no more.
    """
    found = sp.expand(given)
    others = (sp.expand(rule(found)) for rule in (TR5, TR6))  # by cosines, by sines
    return min(found, *others, key=sp.count_ops)


def _link(body: Particle | RigidBody, kinetic: sp.Expr, mass: sp.Expr, place: sp.Matrix) -> LinkEnergy:
    potential = body.potential if isinstance(body.potential, Mapping) else {POTENTIAL: body.potential}
    if not isinstance(body.gravity, Sequence) or len(body.gravity):
        field_ = _vector("gravity", body.gravity, (len(place),))
        if GRAVITY in potential:
            raise LinkwiseError(
                "its potential names gravity, and it has a field of gravity too; leave one out"
            )
        potential = {GRAVITY: -mass * place.dot(field_), **potential}
    return LinkEnergy(body.name, kinetic, potential, body.dissipation, body.forces)


def _vector(what: str, given: Any, lengths: Sequence[int]) -> sp.Matrix:
    try:
        vector = None if isinstance(given, str) else sp.Matrix([sp.sympify(x, strict=True) for x in given])
    except (TypeError, ValueError, sp.SympifyError):
        vector = None
    if vector is None or vector.shape not in [(length, 1) for length in lengths]:
        wanted = " or ".join(map(str, lengths))
        raise LinkwiseError(f"its {what} is {short(repr(given))}; give {wanted} components")
    return vector


def _matrix(what: str, given: Any) -> sp.Matrix:
    try:
        matrix = sp.Matrix(given)
    except (TypeError, ValueError, sp.SympifyError):
        matrix = None
    if matrix is None or matrix.shape != (3, 3):
        raise LinkwiseError(f"its {what} is {short(repr(given))}; give three rows of three")
    return matrix


def _inertia(given: Any) -> sp.Matrix:
    given = given.tolist() if hasattr(given, "tolist") and not isinstance(given, sp.MatrixBase) else given
    rows = list(given) if isinstance(given, Sequence) else given
    if isinstance(rows, list) and len(rows) == 3 and not any(isinstance(row, Sequence) for row in rows):
        return sp.diag(*rows)
    return _matrix("inertia", given)


def _mass(given: object, values: Values) -> sp.Expr:
    mass = expression_of("mass", given)
    value = sp.sympify(mass.xreplace(dict(values)))
    if value.is_number and value.is_negative:
        told = str(mass) if mass.is_number else f"{mass} = {float(value):g}"
        raise LinkwiseError(f"its mass is {told}, and no body has a negative one")
    return mass


def _at_random(matrix: sp.Matrix, values: Values) -> sp.Matrix:
    """Return a matrix at a position drawn at random, with these values of parameters."""
    chosen = random.Random(0)
    free = sorted(matrix.free_symbols - set(values), key=str) + sorted(matrix.atoms(AppliedUndef), key=str)
    return matrix.subs({**dict(values), **{one: chosen.uniform(0.1, 1.0) for one in free}}).evalf()


def _check_rotation(turned: sp.Matrix, values: Values) -> None:
    found = _at_random(turned, values)
    apart = found.T * found - sp.eye(3)
    if not all(number.is_number for number in found):
        return
    if max(abs(number) for number in apart) > ROUNDED:
        raise LinkwiseError("its rotation is none: its columns are not of length 1 and at right angles")
    if found.det() < 0:
        raise LinkwiseError("its rotation is a reflection: its determinant is -1")


def _check_inertia(inertia: sp.Matrix, values: Values) -> None:
    found = _at_random(inertia, values)
    if not all(number.is_number and number.is_real for number in found):
        return
    rows = np.array(found.tolist(), dtype=float)
    size = ROUNDED * np.abs(rows).max()
    if np.abs(rows - rows.T).max() > size:
        raise LinkwiseError("its inertia is not symmetric; give I_xy twice, and so on")
    least, middle, most = np.linalg.eigvalsh(rows)
    if least < -size or most > least + middle + size:
        raise LinkwiseError(
            f"its principal inertias are {least:.3g}, {middle:.3g} and {most:.3g}, which no rigid body has: "
            "none is negative, or more than the two others together"
        )
