"""Terms of one link as a user writes them, sorted into kinetic energy and shares.

With T the kinetic energy as written, and T₁ and T₀ its terms of degree one and none in the velocities, which
are there where a motion is imposed from outside, as on a turning table: the kinetic energy is what is left,
and T₁ + T₀ belong to the share `imposed motion`.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import sympy as sp
from linkwise_runtime.structure import IMPOSED_MOTION

from linkwise.errors import LinkwiseError
from linkwise.escape import short
from linkwise.symbolic.jumps import jump
from linkwise.symbolic.system import DISSIPATION, FORCE, POTENTIAL, LinkEnergy, LinkTerms, Share
from linkwise.symbolic.velocity_degree import degree_in
from linkwise.symbolic.written_motion import WrittenMotion

MOST_DEGREE = 12
"""Highest power of velocities that is taken: higher ones may never finish."""
RESERVED = (IMPOSED_MOTION, "acceleration", "velocity")
"""Names that other shares have."""


@dataclass
class GivenTerms:
    """Expressions of a link by kind and name, as written; `forces` by name and index of the coordinate."""

    kinetic: sp.Expr
    potential: dict[str, sp.Expr]
    dissipation: dict[str, sp.Expr]
    forces: dict[str, dict[int, sp.Expr]] = field(default_factory=dict)

    def all(self) -> Iterator[tuple[str, sp.Expr]]:
        """Yield every expression with what it is, in words."""
        yield "kinetic energy", self.kinetic
        for name, expr in self.potential.items():
            yield f"potential energy{_called(name, POTENTIAL)}", expr
        for name, expr in self.dissipation.items():
            yield f"dissipation{_called(name, DISSIPATION)}", expr
        for name, by_joint in self.forces.items():
            yield from ((f"force{_called(name, FORCE)}", expr) for expr in by_joint.values())

    def mapped(self, function: Callable[[sp.Expr], sp.Expr]) -> "GivenTerms":
        """Return the terms with every expression replaced."""
        return GivenTerms(
            function(self.kinetic),
            {name: function(expr) for name, expr in self.potential.items()},
            {name: function(expr) for name, expr in self.dissipation.items()},
            {name: {i: function(e) for i, e in by_joint.items()} for name, by_joint in self.forces.items()},
        )


def written_terms(link: LinkEnergy, motion: WrittenMotion) -> GivenTerms:
    """Return the expressions of a link by kind and name; raises LinkwiseError for what is none."""
    forces = link.forces
    if not isinstance(forces, Mapping):
        raise LinkwiseError(
            f"its forces are {short(repr(forces))}; give a dictionary of forces by coordinate"
        )
    named = [isinstance(value, Mapping) for value in forces.values()]
    if any(named) and not all(named):
        raise LinkwiseError("its forces stand partly by name, partly by coordinate; give names to all")
    by_name = forces if any(named) else {FORCE: forces}
    terms = GivenTerms(
        expression_of("kinetic energy", link.kinetic),
        _named("potential energy", link.potential, POTENTIAL),
        _named("dissipation", link.dissipation, DISSIPATION),
    )
    for name, given in by_name.items():
        _check_name(name)
        by_joint = {
            motion.index(at): expression_of(f"force{_called(name, FORCE)}", q) for at, q in given.items()
        }
        if len(by_joint) < len(given):
            raise LinkwiseError(f"its force{_called(name, FORCE)} names a coordinate twice")
        terms.forces[name] = by_joint
    _check_apart(terms)
    return terms.mapped(motion.plain)


def _check_apart(terms: GivenTerms) -> None:
    """Raise LinkwiseError for a name that two kinds have: their shares would be one, without a word."""
    given = (
        *(("potential", name, expr != 0) for name, expr in terms.potential.items()),
        *(("dissipation", name, expr != 0) for name, expr in terms.dissipation.items()),
        *(("force", name, any(q != 0 for q in by_joint.values())) for name, by_joint in terms.forces.items()),
    )
    by_name: dict[str, str] = {}
    for kind, name, counts in given:
        if counts:
            if name in by_name:
                raise LinkwiseError(
                    f"its {by_name[name]} and its {kind} are both called {name!r}, and would be one share; "
                    "give each a name of its own"
                )
            by_name[name] = kind


def sorted_terms(
    name: str, terms: GivenTerms, motion: WrittenMotion, numbers: Mapping[sp.Symbol, sp.Float]
) -> LinkTerms:
    """Return what the terms of a link are to its dynamics.

    numbers: values of parameters, to look for jumps with

    Raises LinkwiseError for a kinetic energy that is no polynomial in the velocities, a potential of degree
    two or more, energies with inputs, and energies and dissipation that jump.
    """
    _check_inputs(terms, motion)
    for what, expr in terms.all():
        if not what.startswith("force") and (where := jump(expr.xreplace(dict(numbers)))) is not None:
            raise LinkwiseError(
                f"its {what} jumps where {short(str(where))} passes zero, and has no force there; join the "
                "pieces, or give the force itself among `forces`"
            )
    kinetic, degree, imposed = _kinetic(terms.kinetic, motion)
    potential = {named: _potential(named, expr, motion) for named, expr in terms.potential.items()}
    for named, expr in terms.dissipation.items():
        if expr != 0 and not expr.has(*motion.velocities):
            raise LinkwiseError(
                f"its dissipation{_called(named, DISSIPATION)} depends on no velocity: its force would be 0"
            )
    nothing = sp.S.Zero
    shares = [
        Share(
            named,
            *potential.get(named, (nothing, nothing)),
            terms.dissipation.get(named, nothing),
            {i: q for i, q in sorted(terms.forces.get(named, {}).items()) if q != 0},
        )
        for named in dict.fromkeys((*potential, *terms.dissipation, *terms.forces))
    ]
    found = [share for share in shares if any(share.parts())]
    if imposed != 0 or (motion.time is not None and kinetic.has(motion.time)):
        found.append(Share(IMPOSED_MOTION, motion=imposed))
    return LinkTerms(name, kinetic, degree, tuple(found))


def _kinetic(written: sp.Expr, motion: WrittenMotion) -> tuple[sp.Expr, int, sp.Expr]:
    """Return the kinetic energy of degree two and more, its degree, and the terms of degree one and none."""
    velocities = motion.velocities
    degree = degree_in(written, velocities)
    if degree is None:
        raise LinkwiseError(
            "its kinetic energy is no polynomial in the velocities, so that no share of it has an owner; "
            "expand it up to some degree"
        )
    if degree > MOST_DEGREE:
        raise LinkwiseError(
            f"its kinetic energy has degree {degree} in the velocities; up to {MOST_DEGREE} are taken"
        )
    rest = dict.fromkeys(velocities, sp.S.Zero)
    still = written.xreplace(rest)
    slopes = {v: sp.diff(written, v).xreplace(rest) for v in velocities if written.has(v)}
    imposed = sp.Add(still, *(slope * v for v, slope in slopes.items()))
    if sp.expand(imposed) == 0:
        return written, degree if written != 0 else 2, sp.S.Zero
    if degree <= 2:
        moving = {v: sp.diff(written, v) for v in slopes}
        pairs = [(v, w) for at, v in enumerate(slopes) for w in list(slopes)[at:]]
        kinetic = sp.Add(*(sp.diff(moving[v], w) * v * w / (2 if v == w else 1) for v, w in pairs))
        return kinetic, 2, imposed
    return written - imposed, degree, imposed


def _potential(name: str, written: sp.Expr, motion: WrittenMotion) -> tuple[sp.Expr, sp.Expr]:
    """Return what a potential stores, and its term of the Lagrangian that is linear in the velocities."""
    degree = degree_in(written, motion.velocities)
    if degree is None or degree > 1:
        told = (
            "is no polynomial in the velocities"
            if degree is None
            else f"has degree {degree} in the velocities"
        )
        raise LinkwiseError(
            f"its potential energy{_called(name, POTENTIAL)} {told}; what is of degree two and more is "
            "kinetic: write it there, with the other sign"
        )
    stored = written.xreplace(dict.fromkeys(motion.velocities, sp.S.Zero))
    return (written, sp.S.Zero) if degree == 0 else (stored, stored - written)


def _check_inputs(terms: GivenTerms, motion: WrittenMotion) -> None:
    """Raise LinkwiseError for an energy with an input, whose rate nobody gives."""
    for what, expr in terms.all():
        inputs = [symbol for symbol in motion.inputs if expr.has(symbol)]
        if inputs and what.startswith(("kinetic", "potential")):
            raise LinkwiseError(
                f"its {what} has the input {inputs[0]}, whose change would change the energy; give the force "
                "that it exerts among `forces`, or write it as a function of time"
            )


def _named(what: str, given: object, usual: str) -> dict[str, sp.Expr]:
    """Return expressions by name; one alone has the usual name."""
    if not isinstance(given, Mapping):
        return {usual: expression_of(what, given)}
    for name in given:
        _check_name(name)
    return {name: expression_of(f"{what}{_called(name, usual)}", expr) for name, expr in given.items()}


def _check_name(name: object) -> None:
    if not isinstance(name, str) or not name.strip() or not name.isprintable():
        raise LinkwiseError(f"a share is called {short(repr(name))}; give it a name in quotes")
    if name != name.strip():
        raise LinkwiseError(f"a share is called {short(repr(name))}; leave out the spaces around its name")
    if name in RESERVED:
        raise LinkwiseError(f"a share is called {name!r}, as are those of motion; choose another name")


def _called(name: str, usual: str) -> str:
    return "" if name == usual else f" {name!r}"


def expression_of(what: str, given: object) -> sp.Expr:
    """Return what a user gives as an expression; raises LinkwiseError for anything else, by `what`."""
    try:
        expression = sp.sympify(given, strict=True)
    except sp.SympifyError:
        expression = None
    if not isinstance(expression, sp.Expr) or expression.is_Matrix:
        raise LinkwiseError(f"its {what} is {short(repr(given))}; give a SymPy expression, 0 for none")
    return expression


def symbols_of(terms: Iterable[tuple[str, sp.Expr]]) -> set[sp.Symbol]:
    """Return the symbols of expressions with what they are."""
    return set().union(*(expr.free_symbols for _, expr in terms))
