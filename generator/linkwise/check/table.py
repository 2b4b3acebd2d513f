"""The table of all checks, in the order in which their results are told."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from linkwise.check.as_generated import GeneratedFiles, check_files, check_import, check_texts
from linkwise.check.compare import Result, skipped
from linkwise.check.constraint_checks import loop_calls
from linkwise.check.derivations import derivations, recorded_parts
from linkwise.check.formula_texts import check_formulas
from linkwise.check.frame_checks import frame_calls
from linkwise.check.impedance_checks import impedance_calls
from linkwise.check.induced_checks import induced_calls
from linkwise.check.loading import LoadedPackage
from linkwise.check.model_calls import Named, against_reference
from linkwise.check.parametric_tree import check_bodies, check_numbers
from linkwise.check.passive_checks import passive_calls
from linkwise.check.regressor_checks import regressor_calls
from linkwise.check.simulation_checks import simulation_calls
from linkwise.check.subject import BackendAnswers, Subject, check_energies, there
from linkwise.check.sum_checks import sums_against_reference

T = TypeVar("T")


def _always(_: object) -> bool:
    return True


def _nothing(_: object) -> str:
    return ""


@dataclass(frozen=True)
class Check(Generic[T]):
    """A check: of what, when it applies, and how it runs.

    title: what it is called where it breaks off or is left out, and where its results bear no back end's name
    of: what it is held for, each time anew: the files as they lie there, the package once it is imported, it
    with values of its parameters, or what one back end, or the C, answers for such values
    applies: whether it concerns such a thing
    run: yields the results, given the name that they bear and the thing
    left_out: why it is not run here although it applies; empty if it is run
    needed: whether nothing else is asked where it fails
    """

    title: str
    of: type[T]
    applies: Callable[[T], bool]
    run: Callable[[str, T], Iterable[Result]]
    left_out: Callable[[T], str] = _nothing
    needed: bool = False


def _is_called(answers: BackendAnswers) -> bool:
    return not answers.is_c and not answers.is_refused


def _by_forms(answers: BackendAnswers) -> bool:
    """Return whether calls composed of answers, which are checked for both kernels, are those of this one."""
    return _is_called(answers) and answers.way.kernel != "rule"


def _moves_on(answers: BackendAnswers) -> bool:
    return _by_forms(answers) and answers.subject.closed_states is not None


def _with_torch(answers: BackendAnswers) -> str:
    """Return why calls composed of coefficients and torques are left out where torch's compose them alike."""
    composed = "of a robot as large as this, held of torch, which composes it of the same answers"
    return composed if answers.way.backend == "autograd" and answers.subject.composed_elsewhere else ""


def _named(answers: BackendAnswers) -> Named:
    return Named(answers.name, answers.model, answers.subject.rows, answers.subject.reference)


def _states(name: str, package: LoadedPackage) -> Iterable[Result]:
    few, rest = package.count
    told = f"{few} random ones instead of {package.samples}, and {rest} at rest"
    return [Result(name, True, None, f"{told}: for more it would take gigabytes")]


def _has_parametric_bodies(s: Subject) -> bool:
    return s.tree is not None and bool(s.parameters)


def _bodies(name: str, s: Subject) -> Iterable[Result]:
    unphysical = bool(s.manifest.request.get("allow_unphysical"))
    bodies = s.package.module.ROBOT.bodies
    told = f"{name}: bodies that load looks at"
    return [check_bodies(told, there(s.manifest.tree), bodies, s.parameters, unphysical)]


def _formulas(ending: str) -> Check[Subject]:
    file = f"formulas.{ending}"
    return Check(
        file,
        Subject,
        lambda s: s.is_defined and file in s.manifest.files,
        lambda name, s: check_formulas(name, ending, s),
    )


def _induced(name: str, a: BackendAnswers) -> Iterable[Result]:
    s = a.subject
    load_of = s.package.module.AppliedLoad
    return induced_calls(name, a.model, s.passive, s.reference, s.frames, load_of)


def _controllers(name: str, a: BackendAnswers) -> Iterable[Result]:
    s = a.subject
    return impedance_calls(name, a.model, s.tree, s.reference, s.package.module.Natural)


def _derivations(name: str, s: Subject) -> Iterable[Result]:
    how = "from energies" if s.manifest.request.get("derivation") == "energy" else "by the rigid rule"
    return derivations(name, {way.label: m for way, m in s.loaded.items()}, s.rows, s.reference, how)


NEAR_NONE = "loops close near none of the states, or only next to singular positions"
LARGE = (
    "of a robot as large as this: batches of other shapes, modules of links beyond the first, and recorded "
    "graphs of links that many joints carry; what cuts batches and records graphs is alike for all robots"
)

CHECKS: tuple[Check[Any], ...] = (
    Check("hashes", GeneratedFiles, _always, check_files, needed=True),
    Check("texts", GeneratedFiles, _always, check_texts, needed=True),
    Check("import", GeneratedFiles, _always, check_import, needed=True),
    Check("manifest", GeneratedFiles, _always, lambda _, files: files.compared[:1], needed=True),
    Check("made", GeneratedFiles, _always, lambda _, files: files.compared[1:]),
    Check("back ends", LoadedPackage, _always, lambda _, package: package.missing),
    Check("c", LoadedPackage, lambda package: package.has_c, lambda _, package: [package.compiling[1]]),
    Check("states", LoadedPackage, lambda package: package.count[0] < package.samples, _states),
    Check(
        "parameters: formulas of the bodies give their numbers",
        Subject,
        lambda s: _has_parametric_bodies(s) and s.as_generated,
        lambda name, s: [check_numbers(name, there(s.manifest.tree), s.parameters)],
    ),
    Check("parameters", Subject, _has_parametric_bodies, _bodies),
    Check("energies", Subject, lambda s: s.manifest.energies is not None, check_energies),
    _formulas("txt"),
    _formulas("tex"),
    Check(
        "numbers",
        Subject,
        lambda s: s.is_defined and not s.has_numbers,
        lambda name, _: [skipped(name, "nothing here computes with the energies")],
    ),
    Check(
        "constraints",
        Subject,
        lambda s: s.has_numbers and s.tied and s.loops is None,
        lambda name, _: [skipped(name, NEAR_NONE)],
    ),
    Check(
        "parts of the checks",
        Subject,
        lambda s: s.has_numbers and s.reference.is_large,
        lambda name, _: [skipped(name, LARGE)],
    ),
    Check("functions", BackendAnswers, lambda a: a.is_c, lambda _, a: a.of_c),
    Check(
        "not called",
        BackendAnswers,
        lambda a: a.is_refused,
        lambda name, _: [skipped(f"{name}: not called", "its C is wrong, see above")],
    ),
    Check(
        "coefficients and torques",
        BackendAnswers,
        _is_called,
        lambda _, a: against_reference(_named(a), a.subject.manifest),
    ),
    Check(
        "recorded graphs",
        BackendAnswers,
        lambda a: a.way.backend == "autograd",
        lambda _, a: [recorded_parts(_named(a))],
    ),
    Check(
        "sums over the links",
        BackendAnswers,
        _is_called,
        lambda name, a: sums_against_reference(name, a.model, a.subject.reference),
        _with_torch,
    ),
    Check(
        "regressors",
        BackendAnswers,
        lambda a: _is_called(a) and a.subject.tree is not None and a.model.backend.rule is not None,
        lambda name, a: regressor_calls(name, a.model, there(a.subject.regressors)),
        _with_torch,
    ),
    Check(
        "frames",
        BackendAnswers,
        lambda a: _by_forms(a) and a.subject.tree is not None,
        lambda name, a: frame_calls(name, a.model, there(a.subject.frames)),
        _with_torch,
    ),
    Check(
        "constraints",
        BackendAnswers,
        lambda a: _by_forms(a) and a.subject.loops is not None,
        lambda name, a: loop_calls(name, a.model, there(a.subject.loops)),
        _with_torch,
    ),
    Check(
        "contacts",
        BackendAnswers,
        _moves_on,
        lambda name, a: a.subject.contacts.calls(name, a.model, a.subject.package.module.Contact),
        _with_torch,
    ),
    Check(
        "a simulated motion",
        BackendAnswers,
        _moves_on,
        lambda name, a: simulation_calls(name, a.model, a.subject.simulation),
        _with_torch,
    ),
    Check(
        "passive torques",
        BackendAnswers,
        _is_called,
        lambda name, a: passive_calls(name, a.model, a.subject.passive, a.subject.reference),
        _with_torch,
    ),
    Check("induced accelerations", BackendAnswers, _by_forms, _induced, _with_torch),
    Check("controllers", BackendAnswers, _by_forms, _controllers, _with_torch),
    Check("derivations", Subject, lambda s: s.has_numbers and s.tree is not None, _derivations),
)
"""Neighbours that are held for things of one kind are asked of each such thing in turn."""
