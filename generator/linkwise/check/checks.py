"""The checks of `linkwise check`."""

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, suppress
from functools import partial
from importlib.util import find_spec
from itertools import product
from pathlib import Path

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.native.build import PARTS, Sources, library
from linkwise_runtime.native.system import system_here

from linkwise.check.as_generated import check_files, check_made, check_manifest, check_texts
from linkwise.check.back_end_checks import CHECKS
from linkwise.check.c_functions import CFunctions, References, compile_c
from linkwise.check.compare import IndexRows, Result, is_short_of_memory, skipped
from linkwise.check.derivations import derivations
from linkwise.check.formula_texts import check_formulas
from linkwise.check.parametric_tree import changed_values, check_bodies
from linkwise.check.subject import BackendVariant, Subject, long_enough
from linkwise.oracle.reference import Reference
from linkwise.oracle.states import affordable
from linkwise.own_process import Ended, begun
from linkwise.package.load import Package, load_package, refuse_exit
from linkwise.package.manifest import Manifest

OPTIONAL = ("torch",)
"""Libraries that a package's back ends may need beside NumPy."""
COMPOSED = "of a robot as large as this, held of torch, which composes it of the same answers"
LARGE = (
    "of a robot as large as this: batches of other shapes, modules of links beyond the first, and recorded "
    "graphs of links that many joints carry; what cuts batches and records graphs is alike for all robots"
)
SAMPLES = 100
"""Number of random states, unless another is asked for."""
LEAST = 10
"""Number of states below which nothing is proved of energies that are not defined everywhere."""


def check_package(directory: Path, samples: int = SAMPLES) -> list[Result]:
    """Run every check on a package and return the results.

    Raises LinkwiseError when `directory` holds no package that can be read.
    """
    return list(results_of(directory, samples))


def results_of(directory: Path, samples: int = SAMPLES) -> Iterator[Result]:
    """Yield the results of every check on a package, each as soon as it is there.

    Raises LinkwiseError when `directory` holds no package that can be read.
    """
    manifest = Manifest.read(directory)
    files = check_files(directory, manifest)
    yield from files
    if any(result.failed for result in files):
        return
    yield (texts := check_texts(directory, manifest))
    if texts.failed:
        return
    try:
        with refuse_exit():
            package = load_package(directory, manifest)
            agrees, made = check_manifest(package), check_made(package)
    except Exception as error:
        yield Result("import", False, None, _line(error))
        return
    yield agrees
    if agrees.failed:
        return
    yield made
    beside = "native" in package.backends and system_here().forks
    compiled = begun(partial(_compile, package)) if beside else lambda: None
    with refuse_exit():
        loaded, missing = _load(package)
    yield from missing
    yield from _guarded("answers", _numbers(package, loaded, samples))
    with suppress(Ended):
        compiled()


def _compile(package: Package) -> None:
    """Compile the libraries of `native` beside other work; a failure is reported when they are needed."""
    sources = Sources(package.manifest.name, package.directory / "c")
    with suppress(RuntimeError), open(os.devnull, "w") as nobody, redirect_stderr(nobody):
        for real, what in product(("double", "float"), PARTS):
            library(sources, real, what)


def _load(package: Package) -> tuple[dict[BackendVariant, Dynamics], list[Result]]:
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
                missing.append(Result(f"{name}: loads", False, None, _line(error)))
    if not loaded:
        missing.append(Result("back ends", False, None, "none could be loaded; nothing was checked"))
    return loaded, missing


@contextmanager
def _one_thread() -> Iterator[None]:
    """Let torch compute in one thread if it is loaded: with few samples, further threads only wait."""
    torch = sys.modules.get("torch")
    if torch is None:
        yield
        return
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


def _lacks(error: Exception) -> bool:
    """Return whether a library, compiler, place to compile or stack is missing: not the package's fault."""
    if is_short_of_memory(error):
        return True
    if isinstance(error, ImportError):
        library = (error.name or "").partition(".")[0]
        return library in OPTIONAL and find_spec(library) is None
    here = any(word in str(error) for word in ("install", "LINKWISE_CACHE", "stack"))
    return isinstance(error, RuntimeError) and here and " failed: " not in str(error)


def _numbers(package: Package, loaded: Mapping[BackendVariant, Dynamics], samples: int) -> Iterator[Result]:
    """Yield all results for the parameters as generated and, if there are any, for other values too."""
    manifest = package.manifest
    rows = IndexRows.of_paths([link.path for link in manifest.links], package.module.ROBOT.linear)
    compiled = None
    if f"c/{manifest.name}.h" in manifest.files:
        compiled, result = compile_c(manifest, package.directory, rows)
        yield result
    count = few, rest = affordable(samples, len(manifest.joints), len(manifest.links))
    if few < samples:
        told = f"{few} random ones instead of {samples}, and {rest} at rest: for more it would take gigabytes"
        yield Result("states", True, None, told)
    values = dict(manifest.parameters)
    yield from _results(Subject(package, "", values, loaded, rows, compiled, count))
    if values:
        # Every parameter changed a little, so that no two are equal and none is zero.
        values = changed_values(manifest.parameters, manifest.tree)
        loaded = {way: package.load(way.backend, values, way.kernel) for way in loaded}
        others = ", other parameters"
        yield from _results(Subject(package, others, values, loaded, rows, compiled, count))


def _results(subject: Subject) -> Iterator[Result]:
    """Yield the results of the bodies, the texts, the C, and every back end."""
    manifest, label = subject.package.manifest, subject.label
    if manifest.tree is not None and subject.parameters:
        unphysical = bool(manifest.request.get("allow_unphysical"))
        bodies = subject.package.module.ROBOT.bodies
        yield from check_bodies(manifest.tree, bodies, subject.parameters, unphysical, label)
    reference, tried = subject.tried_reference
    if manifest.energies is not None:
        yield from _remarks(f"energies{label}", reference, tried, subject.count[0])
    if reference is None and tried:
        return
    yield from check_formulas(subject.package, subject.rows, subject.parameters, label, reference)
    if reference is None:
        yield skipped(f"numbers{label}", "nothing here computes with the energies")
        return
    if subject.tied and subject.loops is None:
        told = "loops close near none of the states, or only next to singular positions"
        yield skipped(f"constraints{label}", told)
    if reference.is_large:
        yield skipped(f"parts of the checks{label}", LARGE)
    functions, wrong = subject.functions, False
    # A wrong function of C may write anywhere: it runs in its own process, beside all back ends but native.
    calls = begun(_c_calls(functions, f"c{label}", subject), long_enough()) if functions else list
    for way, model in sorted(subject.loaded.items(), key=lambda item: item[0].backend == "native"):
        name = f"{way.label}{label}"
        if way.backend == "native":
            results, calls = _c_results(calls, f"c{label}"), list
            wrong = any(result.failed for result in results)
            yield from results
        if way.backend == "native" and wrong:
            # C that writes beyond its arrays would crash the interpreter.
            yield skipped(f"{name}: not called", "its C is wrong, see above")
            continue
        for check in CHECKS:
            if not check.concerns(subject, way):
                continue
            if check.composed and way.backend == "autograd" and subject.composed_elsewhere:
                yield skipped(f"{name}: {check.title}", COMPOSED)
            else:
                yield from _guarded(f"{name}: {check.title}", check.run(subject, name, model))
    yield from _c_results(calls, f"c{label}")
    if subject.tree is not None:
        how = "from energies" if manifest.request.get("derivation") == "energy" else "by the rigid rule"
        ways = {way.label: model for way, model in subject.loaded.items()}
        yield from derivations(ways, subject.rows, reference, how, label)


def _guarded(title: str, results: Iterator[Result]) -> Iterator[Result]:
    """Yield results up to where a check breaks off, and then one that reports so: other checks still run.

    Each result is computed by itself, since the settings used meanwhile must not reach whoever receives it.
    """
    while True:
        try:
            # A user's energies need not be defined everywhere.
            with refuse_exit(), np.errstate(all="ignore"), _one_thread():
                result = next(results, None)
        except Exception as error:
            if is_short_of_memory(error):
                yield skipped(title, f"it takes more memory than there is here: {_line(error)}")
            else:
                yield Result(title, False, None, _line(error))
            return
        if result is None:
            return
        yield result


def _remarks(name: str, reference: Reference | None, tried: int, samples: int) -> Iterator[Result]:
    """Yield remarks on energies that a user wrote: what they are compared with, and at how many states."""
    if not find_spec("torch"):
        own = "a user's own, and no torch here to differentiate them: its own torques are what counts"
        yield skipped(f"{name}: not held against their text", own)
    kept = len(reference.states.q) if reference else 0
    detail = f"numbers at {kept} of {tried} random states"
    if tried and kept < min(LEAST, samples / 2):
        yield Result(f"{name}: are defined", False, None, f"{detail}: too few to prove anything")
    elif kept < tried:
        yield Result(f"{name}: are defined", True, None, detail)


def _c_calls(functions: CFunctions, name: str, subject: Subject) -> Callable[[], list[Result]]:
    """Return a call that gives the results of each function of the C."""
    references = References(subject.reference, subject.regressors, subject.frames)
    return lambda: list(functions.check(name, references))


def _c_results(calls: Callable[[], list[Result]], name: str) -> list[Result]:
    """Return the results of the C functions, or a failed one where their process ended."""
    try:
        return calls()
    except Ended as ended:
        return [Result(f"{name}: runs to its end", False, None, str(ended))]


def _line(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"
