"""The checks of `linkwise check`."""

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np

from linkwise.check.as_generated import check_files, check_made, check_manifest, check_texts
from linkwise.check.body_reference import body_reference
from linkwise.check.c_functions import CFunctions, References, compile_c
from linkwise.check.compare import Result, skipped
from linkwise.check.compiled_c import CompiledPackage
from linkwise.check.contact_checks import ContactReference
from linkwise.check.derivations import derivations
from linkwise.check.energy_reference import energy_reference, states_of_energies
from linkwise.check.formula_texts import check_formulas
from linkwise.check.frame_reference import FrameReference, frame_calls, frame_reference
from linkwise.check.impedance_checks import impedance_calls
from linkwise.check.induced_checks import induced_calls
from linkwise.check.loop_checks import loop_calls
from linkwise.check.loop_reference import LoopReference, loop_reference
from linkwise.check.magnitudes import Magnitudes
from linkwise.check.model_calls import Named, against_reference
from linkwise.check.newton_euler import NewtonEuler
from linkwise.check.packed_layout import IndexRows
from linkwise.check.parametric_tree import changed_values, check_bodies, tree_with
from linkwise.check.passive_reference import passive_calls
from linkwise.check.recorded_parts import recorded_parts
from linkwise.check.reference import Reference
from linkwise.check.regressor_reference import regressor_calls, regressor_reference
from linkwise.check.simulation_checks import SimulatedMotion, simulated_motion, simulation_calls
from linkwise.check.states import States, affordable, random_states
from linkwise.check.sum_checks import sums_against_reference
from linkwise.check.text_lagrangian import TextLagrangian
from linkwise.check.torque_reference import states_of_torques, torque_reference
from linkwise.own_process import Ended, begun, in_own_process
from linkwise.package.entries import PassiveEntry, RigidTree
from linkwise.package.load import Array, Model, Package, load_package, staying
from linkwise.package.manifest import Manifest

OPTIONAL = ("torch",)
"""Libraries that a package's back ends may need beside NumPy."""
COMPOSED = "of a robot as large as this, held of torch, which composes it of the same answers"
LEAST = 10
"""States below which nothing is proved of energies that are not defined everywhere."""


def check_package(directory: Path, samples: int = 100) -> list[Result]:
    """Run every check on a package; raises LinkwiseError when `directory` holds none that can be read."""
    return list(results_of(directory, samples))


def results_of(directory: Path, samples: int = 100) -> Iterator[Result]:
    """The same, each result as soon as it is there."""
    manifest = Manifest.read(directory)
    files = check_files(directory, manifest)
    yield from files
    if any(result.failed for result in files):
        return
    yield (texts := check_texts(directory, manifest))
    if texts.failed:
        return
    try:
        with staying():
            package = load_package(directory, manifest)
            agrees, made = check_manifest(package), check_made(package)
    except Exception as error:
        yield Result("import", False, None, _line(error))
        return
    yield agrees
    if agrees.failed:
        return
    yield made
    with staying():
        loaded, missing = _load(package)
    yield from missing
    yield from _guarded("answers", _numbers(package, loaded, samples))


class Way(NamedTuple):
    """A back end, and the kernel that it computes by."""

    backend: str
    kernel: str

    @property
    def label(self) -> str:
        """What results are told under: of two kernels, closed forms bear the name of the back end alone."""
        return f"{self.backend} by rule" if self.kernel == "rule" else self.backend


def _load(package: Package) -> tuple[dict[Way, Model], list[Result]]:
    if not package.backends:
        return {}, [skipped("back ends", "nothing to load: C and formulas only")]
    loaded: dict[Way, Model] = {}
    missing: list[Result] = []
    for name in package.backends:
        try:
            model = package.load(name)
            chooses = getattr(model.backend, "kernel", "") == "auto" and model.backend.name != "native"
            for kernel in ("straight", "rule") if chooses else ("auto",):
                loaded[Way(name, kernel)] = package.load(name, kernel=kernel)
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
    """Let torch compute in one thread where it is loaded: of few samples, others only wait."""
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
    """Whether a library, a compiler, a place to compile or stack is missing here: not the package's fault."""
    if isinstance(error, ImportError):
        library = (error.name or "").partition(".")[0]
        return library in OPTIONAL and find_spec(library) is None
    here = any(word in str(error) for word in ("install", "LINKWISE_CACHE", "stack"))
    return isinstance(error, RuntimeError) and here and " failed: " not in str(error)


def _numbers(package: Package, loaded: Mapping[Way, Model], samples: int) -> Iterator[Result]:
    """Everything for the parameters as generated, and, where there are some, for others too."""
    manifest = package.manifest
    rows = IndexRows.of_paths([link.path for link in manifest.links], package.module.ROBOT.linear)
    compiled = None
    if f"c/{manifest.name}.h" in manifest.files:
        compiled, result = compile_c(manifest, package.directory, rows)
        yield result
    few, rest = affordable(samples, len(manifest.joints), len(manifest.links))
    if few < samples:
        told = f"{few} random ones instead of {samples}, and {rest} at rest: for more it would take gigabytes"
        yield Result("states", True, None, told)
    values = dict(manifest.parameters)
    yield from _Subject(package, "", values, loaded, rows, compiled, (few, rest)).results()
    if values:
        # Every parameter changed a little: equal ones tell no longer one from another, and none is zero.
        values = changed_values(manifest.parameters, manifest.tree)
        loaded = {way: package.load(way.backend, values, way.kernel) for way in loaded}
        yield from _Subject(
            package, ", other parameters", values, loaded, rows, compiled, (few, rest)
        ).results()


@dataclass(frozen=True)
class _Subject:
    """A package for given values of its parameters, and what its numbers are held against.

    label: what tells its results from those for other values
    """

    package: Package
    label: str
    parameters: Mapping[str, float]
    loaded: Mapping[Way, Model]
    rows: IndexRows
    compiled: CompiledPackage | None
    count: tuple[int, int]
    """Of random states, and of those at rest."""

    def results(self) -> Iterator[Result]:
        """The bodies, the texts, the C, and every back end."""
        manifest, label = self.package.manifest, self.label
        if manifest.tree is not None and self.parameters:
            unphysical = bool(manifest.request.get("allow_unphysical"))
            bodies = self.package.module.ROBOT.bodies
            yield from check_bodies(manifest.tree, bodies, self.parameters, unphysical, label)
        reference, tried = self._found
        if manifest.energies is not None:
            yield from _told(f"energies{label}", reference, tried, self.count[0])
        if reference is None and tried:
            return
        yield from check_formulas(self.package, self.rows, self.parameters, label, reference)
        if reference is None:
            yield skipped(f"numbers{label}", "nothing here computes with the energies")
            return
        if self.tied and self.loops is None:
            told = "loops close near none of the states, or only next to singular positions"
            yield skipped(f"constraints{label}", told)
        functions, wrong = self.functions, False
        # A wrong function of C may write anywhere: in a process of its own, beside the back ends but native.
        calls = begun(_c_calls(functions, f"c{label}", self)) if functions else list
        for way, model in sorted(self.loaded.items(), key=lambda item: item[0].backend == "native"):
            name = f"{way.label}{label}"
            if way.backend == "native":
                results, calls = _c_results(calls, f"c{label}"), list
                wrong = any(result.failed for result in results)
                yield from results
            if way.backend == "native" and wrong:
                # What writes beyond its arrays takes the interpreter with it.
                yield skipped(f"{name}: not called", "its C is wrong, see above")
                continue
            for check in CHECKS:
                if not check.concerns(self, way):
                    continue
                if check.composed and way.backend == "autograd" and self.composed_elsewhere:
                    yield skipped(f"{name}: {check.title}", COMPOSED)
                else:
                    yield from _guarded(f"{name}: {check.title}", check.run(self, name, model))
        yield from _c_results(calls, f"c{label}")
        if self.tree is not None:
            how = "from energies" if manifest.request.get("derivation") == "energy" else "by the rigid rule"
            ways = {way.label: model for way, model in self.loaded.items()}
            yield from derivations(ways, self.rows, reference, how, label)

    @property
    def composed_elsewhere(self) -> bool:
        """Whether what autograd takes long for, of a large robot, is held of torch, which is alike in it."""
        return self.reference.is_large and any(way.backend == "torch" for way in self.loaded)

    @property
    def manifest(self) -> Manifest:
        """That of the package."""
        return self.package.manifest

    @cached_property
    def tree(self) -> RigidTree | None:
        """Rigid bodies with these parameters; energies have none."""
        tree = self.package.manifest.tree
        return None if tree is None else tree_with(tree, self.parameters)

    @property
    def tied(self) -> bool:
        """Whether loops of the open tree are closed."""
        return self.tree is not None and self.tree.tied

    @property
    def passive(self) -> tuple[PassiveEntry, ...]:
        """What joints take of their own."""
        return () if self.tree is None else self.tree.passive

    @cached_property
    def functions(self) -> CFunctions | None:
        """The C, if it compiled."""
        if self.compiled is None:
            return None
        return CFunctions(self.package.manifest, self.compiled, self.rows, self.parameters)

    @property
    def reference(self) -> Reference:
        """What torques and their coefficients are held against."""
        return _made(self._found[0])

    @cached_property
    def regressors(self) -> Reference | None:
        """What regressors are held against; energies have none."""
        if self.tree is None:
            return None
        return regressor_reference(self.manifest, self.tree, self.reference.states)

    @cached_property
    def frames(self) -> FrameReference | None:
        """What kinematics is held against; energies have none."""
        return None if self.tree is None else frame_reference(self.manifest, self.tree, self.reference.states)

    @cached_property
    def loops(self) -> LoopReference | None:
        """What constraints are held against; a robot without ties has none."""
        if self.tree is None or not self.tied:
            return None
        return loop_reference(self.manifest, self.tree, self.reference.states)

    @property
    def closed(self) -> States | None:
        """States that the robot can move on from: where ties close."""
        if not self.tied:
            return None if self.tree is None else self.reference.states
        return None if self.loops is None else self.loops.states

    @cached_property
    def contacts(self) -> ContactReference:
        """What contacts are held against."""
        return ContactReference(self.manifest, _made(self.tree), _made(self.closed))

    @cached_property
    def simulated(self) -> SimulatedMotion:
        """A short motion."""
        return simulated_motion(self.manifest, _made(self.tree), _made(self.closed))

    @cached_property
    def _found(self) -> tuple[Reference | None, int]:
        """What numbers are held against, None if nothing can compute or at no state; how many were tried."""
        manifest = self.manifest
        if self.tree is not None:
            samples, rest = self.count
            states = random_states(manifest.joints, samples, rest=rest)
            recursion, magnitudes = NewtonEuler(manifest, self.tree), Magnitudes(manifest, self.tree)
            return body_reference(recursion, magnitudes, states), len(states.q)
        if manifest.energies is not None and find_spec("torch"):
            noises = (None, 1, 2, 3)
            exact, *noisy = (
                [TextLagrangian(energy, self.parameters, noise) for energy in manifest.energies]
                for noise in noises
            )
            found = states_of_energies(exact, manifest.joints, self.count[0])
            defined = len(found.states.q) > 0
            return energy_reference(exact, noisy, found.states) if defined else None, found.tried
        return self._own_reference()

    def _own_reference(self) -> tuple[Reference | None, int]:
        """The torques of one of the package's back ends, else those of its C."""

        def of(name: str, torque: Callable[[Array, Array, Array], Array]) -> tuple[Reference | None, int]:
            found = states_of_torques(torque, self.manifest.joints, self.count[0])
            reference = torque_reference(name, torque, found.states) if len(found.states.q) else None
            return reference, found.tried

        if self.loaded:
            way, model = next(iter(self.loaded.items()))
            return of(way.label, model.partial_torque)
        functions = self.functions
        if functions is None:
            return None, 0
        return in_own_process(lambda: of("c", functions.torque))


@dataclass(frozen=True)
class Check:
    """Calls of a back end that are held against one thing.

    title: what is told where the check itself does not come to its end
    run: its results, from the subject, the back end's label and its model
    by_rule: whether it concerns the vectorised rule too; what is composed of answers that both kernels were
    held against does not
    composed: whether its calls are put together from coefficients and torques alike for every back end
    of: of which subjects and back ends it is
    """

    title: str
    run: Callable[[_Subject, str, Model], Iterator[Result]]
    by_rule: bool = False
    composed: bool = True
    of: Callable[[_Subject, Way], bool] = lambda subject, way: True

    def concerns(self, subject: _Subject, way: Way) -> bool:
        """Whether this back end of this package has such calls."""
        return (self.by_rule or way.kernel != "rule") and self.of(subject, way)


T = TypeVar("T")


def _is_rigid(subject: _Subject, way: Way) -> bool:
    return subject.tree is not None


def _made(what: T | None) -> T:
    """What a check that concerns a subject finds there."""
    assert what is not None
    return what


CHECKS = (
    Check(
        "coefficients and torques",
        lambda s, name, model: against_reference(Named(name, model, s.rows, s.reference), s.manifest),
        by_rule=True,
        composed=False,
    ),
    Check(
        "recorded graphs",
        lambda s, name, model: iter([recorded_parts(Named(name, model, s.rows, s.reference))]),
        composed=False,
        of=lambda s, way: way.backend == "autograd",
    ),
    Check(
        "sums over the links",
        lambda s, name, model: sums_against_reference(name, model, s.reference),
        by_rule=True,
    ),
    Check(
        "regressors",
        lambda s, name, model: regressor_calls(name, model, _made(s.regressors)),
        by_rule=True,
        of=lambda s, way: s.tree is not None and s.loaded[way].backend.rule is not None,
    ),
    Check("frames", lambda s, name, model: frame_calls(name, model, _made(s.frames)), of=_is_rigid),
    Check(
        "constraints",
        lambda s, name, model: loop_calls(name, model, _made(s.loops)),
        of=lambda s, way: s.loops is not None,
    ),
    Check(
        "contacts",
        lambda s, name, model: s.contacts.calls(name, model, s.package.module.Contact),
        of=lambda s, way: s.closed is not None,
    ),
    Check(
        "a simulated motion",
        lambda s, name, model: simulation_calls(name, model, s.simulated),
        of=lambda s, way: s.closed is not None,
    ),
    Check(
        "passive torques",
        lambda s, name, model: passive_calls(name, model, s.passive, s.reference),
        by_rule=True,
    ),
    Check(
        "induced accelerations",
        lambda s, name, model: induced_calls(
            name, model, s.passive, s.reference, s.frames, s.package.module.AppliedLoad
        ),
    ),
    Check(
        "controllers",
        lambda s, name, model: impedance_calls(name, model, s.passive, s.reference, s.package.module.Natural),
    ),
)
"""What is held of each back end, in the order in which it is told."""


def _guarded(title: str, results: Iterator[Result]) -> Iterator[Result]:
    """Results up to where a check breaks off, and that it did: the others are made all the same.

    Each is computed by itself, for what holds while it is must not hold for whoever takes it.
    """
    while True:
        try:
            # Energies of a user's own need not be defined everywhere.
            with staying(), np.errstate(all="ignore"), _one_thread():
                result = next(results, None)
        except MemoryError as error:
            yield skipped(title, f"it takes more memory than there is here: {error}")
            return
        except Exception as error:
            yield Result(title, False, None, _line(error))
            return
        if result is None:
            return
        yield result


def _told(name: str, reference: Reference | None, tried: int, samples: int) -> Iterator[Result]:
    """What is to be known of energies that a user wrote: what they are held against, and where."""
    if not find_spec("torch"):
        own = "a user's own, and no torch here to differentiate them: its own torques are what counts"
        yield skipped(f"{name}: not held against their text", own)
    kept = len(reference.states.q) if reference else 0
    detail = f"numbers at {kept} of {tried} random states"
    if tried and kept < min(LEAST, samples / 2):
        yield Result(f"{name}: are defined", False, None, f"{detail}: too few to prove anything")
    elif kept < tried:
        yield Result(f"{name}: are defined", True, None, detail)


def _c_calls(functions: CFunctions, name: str, subject: _Subject) -> Callable[[], list[Result]]:
    """What each function of the C gives, when called."""
    references = References(subject.reference, subject.regressors, subject.frames)
    return lambda: list(functions.check(name, references))


def _c_results(calls: Callable[[], list[Result]], name: str) -> list[Result]:
    """The same, where nothing ends its process."""
    try:
        return calls()
    except Ended as ended:
        return [Result(f"{name}: runs to its end", False, None, str(ended))]


def _line(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"
