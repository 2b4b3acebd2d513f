"""Answers that a package can give here, in turn: its back ends, its C, for values of its parameters."""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import redirect_stderr, suppress
from dataclasses import dataclass, replace
from importlib.util import find_spec
from itertools import combinations, product

from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.native.build import PARTS, Sources, library
from linkwise_runtime.native.system import system_here

from linkwise.arrays import Array
from linkwise.check.c_functions import CFunctions, compile_c
from linkwise.check.compare import Entries, IndexRows, Result, compare, is_short_of_memory, line_of, skipped
from linkwise.check.parametric_tree import changed_values
from linkwise.check.subject import BackendVariant, Subject, long_enough
from linkwise.oracle.reference import Reference
from linkwise.own_process import Ended, begun
from linkwise.package.load import Package

OPTIONAL = ("torch",)
"""Libraries that a package's back ends may need beside NumPy."""
DERIVATIONS = {
    "closed forms": ("numpy", "torch"),
    "rule": ("numpy by rule", "torch by rule"),
    "Lagrangians": ("autograd",),
}
"""Derivations, and names of the back ends that compute by them: the first that is there represents it."""


@dataclass(frozen=True)
class BackendAnswers:
    """The answers of a back end for given values of the parameters, or the functions of the C.

    of_c: results on the functions of the C, where these have run
    """

    subject: Subject
    way: BackendVariant
    of_c: Sequence[Result] = ()

    @property
    def name(self) -> str:
        """Name that results are reported under."""
        return f"{self.way.label}{self.subject.label}"

    @property
    def is_c(self) -> bool:
        """True for the functions of the C, which no model calls."""
        return self.way.backend == "c"

    @property
    def is_refused(self) -> bool:
        """True for a back end that is not called, as its C is wrong."""
        return self.way.backend == "native" and any(result.failed for result in self.of_c)

    @property
    def model(self) -> Dynamics:
        """The model that is asked."""
        return self.subject.loaded[self.way]


def subjects(package: Package, samples: int) -> Iterator[Subject]:
    """Yield a package for the parameters as generated and, if there are any, for other values too."""
    manifest = package.manifest
    (loaded, missing), values = _load(package), dict(manifest.parameters)
    rows = IndexRows.of_paths([link.path for link in manifest.links], package.module.ROBOT.nonquadratic)
    compiled, headers = None, []
    if f"c/{manifest.name}.h" in manifest.files:
        compiled, result = compile_c(manifest, package.directory, rows)
        headers.append(result)
    first = Subject(package, "", values, loaded, rows, compiled, samples, missing, headers)
    yield first
    if values:
        # Every parameter changed a little, so that no two are equal and none is zero.
        values = changed_values(manifest.parameters, manifest)
        loaded = {way: package.load(way.backend, values, way.kernel) for way in loaded}
        others = ", other parameters"
        yield replace(first, label=others, parameters=values, loaded=loaded, missing=(), headers=())


def in_turn(subject: Subject) -> Iterator[BackendAnswers]:
    """Yield what is asked for answers, one after the other; nothing where none can be compared.

    A wrong function of C may write anywhere: it runs in its own process, beside all back ends but native,
    which would crash the interpreter by it.
    """
    if not subject.has_numbers:
        return
    calls = _begun(subject, subject.functions) if subject.functions else None
    native = [way for way in subject.loaded if way.backend == "native"]
    yield from (BackendAnswers(subject, way) for way in subject.loaded if way not in native)
    of_c = _told(calls, f"c{subject.label}") if calls else []
    if calls:
        yield BackendAnswers(subject, BackendVariant("c"), of_c)
    yield from (BackendAnswers(subject, way, of_c) for way in native)


def _begun(subject: Subject, functions: CFunctions) -> Callable[[], list[Result]]:
    """Begin to call each function of the C, and return a call that waits for the results."""
    expected = subject.reference, subject.regressors, subject.link_wrenches, subject.frames, subject.uncertain
    return begun(lambda: list(functions.check(f"c{subject.label}", *expected)), long_enough())


def _told(calls: Callable[[], list[Result]], name: str) -> list[Result]:
    """Return the results of the C functions, or a failed one where their process ended."""
    try:
        return calls()
    except Ended as ended:
        return [Result(f"{name}: runs to its end", False, None, str(ended))]


def derivations(name: str, subject: Subject) -> Iterator[Result]:
    """Yield a comparison of every two derivations that are there.

    Each is also compared with the recursion by itself.
    """
    how = "from energies" if subject.manifest.request.get("derivation") == "energy" else "by the rigid rule"
    loaded = {way.label: model for way, model in subject.loaded.items()}
    answers = {}
    for derivation, names in DERIVATIONS.items():
        shown = f"{derivation} ({how})" if derivation == "closed forms" else derivation
        for label in [label for label in names if label in loaded][:1]:
            answers[shown] = _answers(loaded[label], subject.rows, subject.reference)
    for one, other in combinations(answers, 2):
        entries = [
            Entries(
                what, value, answers[other][what][0], scale, None if what == "c0" else subject.rows.of(what)
            )
            for what, (value, scale) in answers[one].items()
        ]
        yield compare(f"{name}: {one} against {other}", entries, subject.reference.tolerance)


def _answers(model: Dynamics, rows: IndexRows, reference: Reference) -> dict[str, tuple[Array, Array]]:
    """Return packed values and slopes by position, each beside its scale."""
    few = slice(-2, None) if reference.is_large else slice(None)
    motion = reference.states.at(few).motion
    found = {
        what: (value, reference.scales[what][few][(slice(None), *rows.of(what).T)])
        for what, value in rows.fields(model.packed(*motion)).items()
    }
    return found | {"c0": (model.position_gradient(*motion), reference.scales["c0"][few])}


def _load(package: Package) -> tuple[dict[BackendVariant, Dynamics], list[Result]]:
    """Return the models of all back ends that can be loaded here, and results on the others."""
    if not package.backends:
        return {}, [skipped("back ends", "nothing to load: C and formulas only")]
    loaded: dict[BackendVariant, Dynamics] = {}
    missing: list[Result] = []
    for name in package.backends:
        try:
            model = package.load(name)
            chooses = getattr(model.backend, "kernel", "") == "auto" and model.backend.name != "native"
            for kernel in ("straight", "rule") if chooses else ("auto",):
                loaded[BackendVariant(name, kernel)] = package.load(name, kernel=kernel)
        except Exception as error:
            if _lacks(error):
                missing.append(skipped(f"{name}: not checked", " ".join(str(error).split())))
            else:
                missing.append(Result(f"{name}: loads", False, None, line_of(error)))
    if not loaded:
        missing.append(Result("back ends", False, None, "none could be loaded; nothing was checked"))
    return loaded, missing


def compiled_beside(package: Package) -> Callable[[], None]:
    """Begin to compile the libraries of `native` beside other work, and return a call that waits for them.

    A failure is reported when they are needed.
    """
    if "native" not in package.backends or not system_here().forks:
        return lambda: None

    def compile_all() -> None:
        sources = Sources(package.manifest.name, package.directory / "c")
        with suppress(RuntimeError), open(os.devnull, "w") as nobody, redirect_stderr(nobody):
            for real, what in product(("double", "float"), PARTS):
                library(sources, real, what)

    return begun(compile_all)


def _lacks(error: Exception) -> bool:
    """Return whether a library, compiler, place to compile or stack is missing: not the package's fault."""
    if is_short_of_memory(error):
        return True
    if isinstance(error, ImportError):
        library = (error.name or "").partition(".")[0]
        return library in OPTIONAL and find_spec(library) is None
    here = any(word in str(error) for word in ("install", "LINKWISE_CACHE", "stack"))
    return isinstance(error, RuntimeError) and here and " failed: " not in str(error)
