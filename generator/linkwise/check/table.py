"""The table of all checks, in the order in which their results are told."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from linkwise.check.answers import BackendAnswers, derivations
from linkwise.check.as_generated import GeneratedFiles, check_files, check_import, check_texts
from linkwise.check.compare import Result, skipped
from linkwise.check.constant_checks import constant_calls
from linkwise.check.constraint_checks import loop_calls
from linkwise.check.formula_texts import check_formulas
from linkwise.check.frame_checks import frame_calls
from linkwise.check.impedance_checks import impedance_calls, tied_impedance_calls
from linkwise.check.induced_checks import induced_calls
from linkwise.check.model_calls import Named, against_reference, recorded_parts
from linkwise.check.parametric_tree import check_bodies, check_numbers
from linkwise.check.reaction_checks import reaction_calls
from linkwise.check.regressor_checks import regressor_calls
from linkwise.check.simulation_checks import simulation_calls
from linkwise.check.subject import NEAR_NONE, Subject, check_energies, there
from linkwise.check.sum_checks import passive_calls, sum_calls

T = TypeVar("T")


def _always(_: object) -> bool:
    return True


@dataclass(frozen=True)
class Check(Generic[T]):
    """A check: of what, when it applies, and how it runs.

    title: names its results or, for a back end, whose name these bear, one that says that it broke off
    of: what it is held for, each time anew: the files as they lie there, the imported package with values of
    its parameters, or what one back end, or the C, answers for such values
    applies: whether it concerns such a thing
    run: yields the results, given the name that they bear and the thing
    needed: whether nothing else is asked where it fails
    """

    title: str
    of: type[T]
    applies: Callable[[T], bool]
    run: Callable[[str, T], Iterable[Result]]
    needed: bool = False


COMPOSED = "of a robot as large as this, held of torch, which composes it of the same answers"
NONE_COMPUTES = "nothing here computes with the energies"
LARGE = (
    "of a robot as large as this: batches of other shapes, modules of links beyond the first, and recorded "
    "graphs of links that many joints carry; what cuts batches and records graphs is alike for all robots"
)


def _left_out(title: str, applies: Callable[[Subject], bool], told: str) -> Check[Subject]:
    """Return a check that says what else is not checked, and why."""
    return Check(title, Subject, applies, lambda name, _: [skipped(name, told)])


def _formulas(ending: str) -> Check[Subject]:
    return Check(
        f"formulas.{ending}",
        Subject,
        lambda s: s.is_defined and f"formulas.{ending}" in s.manifest.files,
        lambda name, s: check_formulas(name, ending, s),
    )


def _called(
    title: str,
    applies: Callable[[BackendAnswers], bool],
    run: Callable[[str, BackendAnswers], Iterable[Result]],
) -> Check[BackendAnswers]:
    """Return a check of calls that each back end composes of coefficients and torques in the same way."""

    def of_one(name: str, a: BackendAnswers) -> Iterable[Result]:
        is_slow = a.way.backend == "autograd" and a.subject.reference.is_large
        elsewhere = is_slow and any(way.backend == "torch" for way in a.subject.loaded)
        return [skipped(f"{name}: {title}", COMPOSED)] if elsewhere else run(name, a)

    return Check(title, BackendAnswers, applies, of_one)


def _by_any(a: BackendAnswers) -> bool:
    return not a.is_c and not a.is_refused


def _of_learned_links(a: BackendAnswers) -> bool:
    """Return whether modules hold the numbers of rigid links, which may be learned."""
    return a.way.backend == "autograd" and a.subject.tree is not None


def _by_forms(a: BackendAnswers) -> bool:
    """Return whether calls composed of answers, which are checked for both kernels, are those of this one."""
    return _by_any(a) and a.way.kernel != "rule"


def _of_frames(a: BackendAnswers) -> bool:
    return _by_forms(a) and a.subject.tree is not None


def _in_loops(a: BackendAnswers) -> bool:
    return _by_forms(a) and a.subject.loops is not None


def _moving_on(a: BackendAnswers) -> bool:
    return _by_forms(a) and a.subject.tree is not None and a.subject.closed_states is not None


def _simulated(a: BackendAnswers) -> bool:
    return _moving_on(a) or (_by_forms(a) and a.subject.terms is not None)


def _of_bodies(a: BackendAnswers) -> bool:
    return _by_any(a) and a.subject.tree is not None and a.model.backend.rule is not None


def _of_wrenches(a: BackendAnswers) -> bool:
    return _of_frames(a) and a.model.backend.regresses


def _parametric(s: Subject) -> bool:
    return s.tree is not None and bool(s.parameters)


def _states(name: str, s: Subject) -> Iterable[Result]:
    few, rest = s.count
    told = f"{few} random ones instead of {s.samples}, and {rest} at rest"
    return [Result(name, True, None, f"{told}: for more it would take gigabytes")]


def _bodies(name: str, s: Subject) -> Iterable[Result]:
    unphysical = bool(s.manifest.request.get("allow_unphysical"))
    bodies = s.package.module.ROBOT.bodies
    return [check_bodies(name, s.manifest, bodies, s.parameters, unphysical)]


def _numbers_of_bodies(name: str, s: Subject) -> Iterable[Result]:
    return [check_numbers(name, s.manifest, s.parameters)]


def _refused(name: str, _: BackendAnswers) -> Iterable[Result]:
    return [skipped(f"{name}: not called", "its C is wrong, see above")]


def _coefficients(name: str, a: BackendAnswers) -> Iterable[Result]:
    return against_reference(Named(name, a.model, a.subject.rows, a.subject.reference), a.subject.manifest)


def _constants(name: str, a: BackendAnswers) -> Iterable[Result]:
    s = a.subject
    other = s.package.load(a.way.backend, s.parameters)
    return constant_calls(name, other, s.manifest, there(s.tree), s.reference.states)


def _graphs(name: str, a: BackendAnswers) -> Iterable[Result]:
    return [recorded_parts(Named(name, a.model, a.subject.rows, a.subject.reference))]


def _contacts(name: str, a: BackendAnswers) -> Iterable[Result]:
    return a.subject.contacts.calls(name, a.model, a.subject.package.module.Contact)


def _passive(name: str, a: BackendAnswers) -> Iterable[Result]:
    return passive_calls(name, a.model, a.subject.passive, a.subject.reference)


def _induced(name: str, a: BackendAnswers) -> Iterable[Result]:
    s = a.subject
    load_of = s.package.module.AppliedLoad
    return induced_calls(name, a.model, s.passive, s.reference, s.frames, load_of)


def _reactions(name: str, a: BackendAnswers) -> Iterable[Result]:
    return reaction_calls(name, a.model, there(a.subject.tree), there(a.subject.reactions))


def _controllers(name: str, a: BackendAnswers) -> Iterable[Result]:
    s = a.subject
    return impedance_calls(name, a.model, s.tree, s.passive, s.reference, s.package.module.Natural)


def _tied_controllers(name: str, a: BackendAnswers) -> Iterable[Result]:
    s = a.subject
    return tied_impedance_calls(name, a.model, there(s.loops), s.package.module.Natural)


CHECKS: tuple[Check[Any], ...] = (
    Check("hashes", GeneratedFiles, _always, check_files, needed=True),
    Check("texts", GeneratedFiles, _always, check_texts, needed=True),
    Check("import", GeneratedFiles, _always, check_import, needed=True),
    Check("manifest", GeneratedFiles, _always, lambda _, files: files.compared[:1], needed=True),
    Check("made", GeneratedFiles, _always, lambda _, files: files.compared[1:]),
    Check("back ends", Subject, _always, lambda _, s: s.missing),
    Check("c", Subject, _always, lambda _, s: s.headers),
    Check("states", Subject, lambda s: s.as_generated and s.count[0] < s.samples, _states),
    Check("parameters", Subject, lambda s: _parametric(s) and s.as_generated, _numbers_of_bodies),
    Check("parameters", Subject, _parametric, _bodies),
    Check("energies", Subject, lambda s: s.manifest.energies is not None, check_energies),
    _formulas("txt"),
    _formulas("tex"),
    _left_out("numbers", lambda s: s.is_defined and not s.has_numbers, NONE_COMPUTES),
    _left_out("constraints", lambda s: s.has_numbers and s.tied and s.loops is None, NEAR_NONE),
    _left_out("parts of the checks", lambda s: s.has_numbers and s.reference.is_large, LARGE),
    Check("functions", BackendAnswers, lambda a: a.is_c, lambda _, a: a.of_c),
    Check("not called", BackendAnswers, lambda a: a.is_refused, _refused),
    Check("coefficients and torques", BackendAnswers, _by_any, _coefficients),
    Check("other numbers of links", BackendAnswers, _of_learned_links, _constants),
    Check("recorded graphs", BackendAnswers, lambda a: a.way.backend == "autograd", _graphs),
    _called("sums over the links", _by_any, lambda name, a: sum_calls(name, a.model, a.subject.reference)),
    _called(
        "regressors", _of_bodies, lambda name, a: regressor_calls(name, a.model, there(a.subject.regressors))
    ),
    _called("frames", _of_frames, lambda name, a: frame_calls(name, a.model, there(a.subject.frames))),
    _called("reactions", _of_wrenches, _reactions),
    _called("constraints", _in_loops, lambda name, a: loop_calls(name, a.model, there(a.subject.loops))),
    _called("controllers in loops", _in_loops, _tied_controllers),
    _called("contacts", _moving_on, _contacts),
    _called(
        "a simulated motion",
        _simulated,
        lambda name, a: simulation_calls(name, a.model, a.subject.simulation),
    ),
    _called("passive torques", _by_any, _passive),
    _called("induced accelerations", _by_forms, _induced),
    _called("controllers", _by_forms, _controllers),
    Check("derivations", Subject, lambda s: s.has_numbers and s.tree is not None, derivations),
)
"""Neighbours that are held for things of one kind are asked of each such thing in turn."""
