"""The checks of `linkwise check`."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np

from linkwise.check.as_generated import check_files, check_manifest, check_runtime
from linkwise.check.body_reference import body_reference
from linkwise.check.c_functions import CFunctions, References, compile_c
from linkwise.check.compare import Result, Skipped
from linkwise.check.compiled_c import CompiledPackage
from linkwise.check.derivations import derivations
from linkwise.check.energy_reference import energy_reference, states_of_energies
from linkwise.check.formula_texts import check_formulas
from linkwise.check.frame_reference import FrameReference, frame_calls, frame_reference
from linkwise.check.impedance_checks import impedance_calls
from linkwise.check.induced_checks import induced_calls
from linkwise.check.loop_checks import loop_calls
from linkwise.check.loop_induced import induced_loop_calls
from linkwise.check.loop_reference import LoopReference, loop_reference
from linkwise.check.magnitudes import Magnitudes
from linkwise.check.model_calls import Named, against_reference
from linkwise.check.motion_checks import MotionReference
from linkwise.check.newton_euler import NewtonEuler
from linkwise.check.packed_layout import IndexRows
from linkwise.check.parametric_tree import changed_values, check_bodies, tree_with
from linkwise.check.passive_reference import passive_calls
from linkwise.check.recorded_parts import recorded_parts
from linkwise.check.reference import Reference
from linkwise.check.regressor_reference import regressor_calls, regressor_reference
from linkwise.check.states import random_states
from linkwise.check.sum_checks import sums_against_reference
from linkwise.check.text_lagrangian import TextLagrangian
from linkwise.check.torque_reference import states_of_torques, torque_reference
from linkwise.own_process import Ended, in_own_process
from linkwise.package.load import Array, Model, Package, load_package, staying
from linkwise.package.manifest import Manifest

OPTIONAL = ("torch",)
"""Libraries that a package's back ends may need beside NumPy."""


def check_package(directory: Path, samples: int = 100) -> list[Result]:
    """Run every check on a package; raises LinkwiseError when `directory` holds none that can be read."""
    manifest = Manifest.read(directory)
    results = check_files(directory, manifest)
    if not results[0].passed:
        return results
    try:
        with staying():
            package = load_package(directory, manifest)
            results.append(check_manifest(package))
            if not results[-1].passed:
                return results
            results.append(check_runtime(package))
    except Exception as error:
        return [*results, Result("import", False, None, _line(error))]
    loaded, missing = _load(package)
    results += missing
    checks = _Checks(package, loaded, samples)
    try:
        with staying(), np.errstate(all="ignore"):  # energies of a user's own need not be defined everywhere
            results += checks.run()
    except Exception as error:
        results.append(Result("answers", False, None, _line(error)))
    return results


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
        return {}, [Skipped("back ends", "nothing to load: C and formulas only")]
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
                missing.append(Skipped(f"{name}: not checked", " ".join(str(error).split())))
            else:
                missing.append(Result(f"{name}: loads", False, None, _line(error)))
    if not loaded:
        missing.append(Result("back ends", False, None, "none could be loaded; nothing was checked"))
    return loaded, missing


def _lacks(error: Exception) -> bool:
    """Whether a library, a compiler, a place to compile or stack is missing here: not the package's fault."""
    if isinstance(error, ImportError):
        library = (error.name or "").partition(".")[0]
        return library in OPTIONAL and find_spec(library) is None
    here = any(word in str(error) for word in ("install", "LINKWISE_CACHE", "stack"))
    return isinstance(error, RuntimeError) and here and " failed: " not in str(error)


LEAST = 10
"""States below which nothing is proved."""


@dataclass(frozen=True)
class _Checks:
    """The checks of one package's numbers: its formulas, its C, and the back ends that load here."""

    package: Package
    loaded: Mapping[Way, Model]
    samples: int

    def run(self) -> Iterator[Result]:
        """Everything for the parameters as generated, and, where there are some, for others too."""
        manifest = self.package.manifest
        rows = IndexRows.of_paths([link.path for link in manifest.links], self.package.module.ROBOT.linear)
        compiled = None
        if f"c/{manifest.name}.h" in manifest.files:
            compiled, result = compile_c(manifest, self.package.directory, rows)
            yield result
        values = dict(manifest.parameters)
        yield from self._numbers("", values, self.loaded, rows, compiled)
        if values:
            yield from self._other_parameters(rows, compiled)

    def _numbers(
        self,
        label: str,
        values: Mapping[str, float],
        loaded: Mapping[Way, Model],
        rows: IndexRows,
        compiled: CompiledPackage | None,
    ) -> Iterator[Result]:
        manifest, c_passes = self.package.manifest, True
        if manifest.tree is not None and values:
            unphysical = bool(manifest.request.get("allow_unphysical"))
            yield from check_bodies(
                manifest.tree, self.package.module.ROBOT.bodies, values, unphysical, label
            )
        functions = CFunctions(manifest, compiled, rows, values) if compiled else None
        reference, tried = self._reference(values, loaded, functions)
        if manifest.energies is not None:
            yield from _told(f"energies{label}", reference, tried, self.samples)
        if reference is None and tried:
            return
        yield from check_formulas(self.package, rows, values, label, reference)
        if reference is None:
            yield Skipped(f"numbers{label}", "nothing here computes with the energies")
            return
        regressors, frames = self._regressors(values, reference), self._frames(values, reference)
        loops = self._loops(values, reference)
        if loops is None and self._is_tied:
            yield Skipped(f"constraints{label}", "loops close near none of the states")
        motions = None
        if manifest.tree is not None and (loops is not None or not self._is_tied):
            closed = reference.states if loops is None else loops.states
            motions = MotionReference.of(manifest, tree_with(manifest.tree, values), closed)
        references = References(reference, regressors, frames)
        for result in _c_results(functions, f"c{label}", references) if functions else ():
            c_passes &= result.passed
            yield result
        for way, model in loaded.items():
            if way.backend == "native" and not c_passes:
                # What writes beyond its arrays takes the interpreter with it.
                yield Skipped(f"{way.label}{label}: not called", "its C is wrong, see above")
            else:
                yield from against_reference(Named(f"{way.label}{label}", model, rows, reference), manifest)
                if way.backend == "autograd":
                    yield recorded_parts(Named(f"{way.label}{label}", model, rows, reference))
                yield from sums_against_reference(f"{way.label}{label}", model, reference)
                if regressors is not None and model.backend.rule is not None:
                    yield from regressor_calls(f"{way.label}{label}", model, regressors)
                if frames is not None and way.kernel != "rule":  # no kernel has a part in it
                    yield from frame_calls(f"{way.label}{label}", model, frames)
                if loops is not None and way.kernel != "rule":
                    yield from loop_calls(f"{way.label}{label}", model, loops)
                    yield from induced_loop_calls(f"{way.label}{label}", model, loops)
                if way.kernel != "rule" and motions is not None:
                    yield from motions.calls(f"{way.label}{label}", model, self.package.module.Contact)
                joints = manifest.tree.passive if manifest.tree is not None else ()
                yield from passive_calls(f"{way.label}{label}", model, joints, reference.states)
                if way.kernel != "rule":  # they are composed of what every kernel was held against
                    record = self.package.module.AppliedLoad
                    yield from induced_calls(f"{way.label}{label}", model, joints, reference, frames, record)
                    natural = self.package.module.Natural
                    yield from impedance_calls(f"{way.label}{label}", model, joints, reference, natural)
        if manifest.tree is not None:
            how = "from energies" if manifest.request.get("derivation") == "energy" else "by the rigid rule"
            ways = {way.label: model for way, model in loaded.items()}
            yield from derivations(ways, rows, reference, how, label)

    def _other_parameters(self, rows: IndexRows, compiled: CompiledPackage | None) -> Iterator[Result]:
        """Every parameter changed a little: equal ones tell no longer one from another, and none is zero."""
        changed = changed_values(self.package.manifest.parameters, self.package.manifest.tree)
        loaded = {way: self.package.load(way.backend, changed, way.kernel) for way in self.loaded}
        yield from self._numbers(", other parameters", changed, loaded, rows, compiled)

    def _reference(
        self, values: Mapping[str, float], loaded: Mapping[Way, Model], functions: CFunctions | None
    ) -> tuple[Reference | None, int]:
        """What numbers are held against, None if nothing can compute or at no state; how many were tried."""
        manifest = self.package.manifest
        n = len(manifest.joints)
        if manifest.tree is not None:
            tree, states = tree_with(manifest.tree, values), random_states(n, self.samples)
            recursion, magnitudes = NewtonEuler(manifest, tree), Magnitudes(manifest, tree)
            return body_reference(recursion, magnitudes, states), len(states.q)
        if manifest.energies is not None and find_spec("torch"):
            noises = (None, 1, 2, 3)
            exact, *noisy = (
                [TextLagrangian(energy, values, noise) for energy in manifest.energies] for noise in noises
            )
            found = states_of_energies(exact, n, self.samples)
            defined = len(found.states.q) > 0
            return energy_reference(exact, noisy, found.states) if defined else None, found.tried
        return self._own_reference(loaded, functions)

    def _regressors(self, values: Mapping[str, float], reference: Reference) -> Reference | None:
        """What regressors are held against; energies have none."""
        manifest = self.package.manifest
        if manifest.tree is None:
            return None
        return regressor_reference(manifest, tree_with(manifest.tree, values), reference.states)

    def _frames(self, values: Mapping[str, float], reference: Reference) -> FrameReference | None:
        """What kinematics is held against; energies have none."""
        manifest = self.package.manifest
        if manifest.tree is None:
            return None
        return frame_reference(manifest, tree_with(manifest.tree, values), reference.states)

    @property
    def _is_tied(self) -> bool:
        tree = self.package.manifest.tree
        return tree is not None and tree.tied

    def _loops(self, values: Mapping[str, float], reference: Reference) -> LoopReference | None:
        """What constraints are held against; a robot without ties has none."""
        manifest = self.package.manifest
        if manifest.tree is None or not self._is_tied:
            return None
        return loop_reference(manifest, tree_with(manifest.tree, values), reference.states)

    def _own_reference(
        self, loaded: Mapping[Way, Model], functions: CFunctions | None
    ) -> tuple[Reference | None, int]:
        """The torques of one of the package's back ends, else those of its C."""
        n = len(self.package.manifest.joints)

        def of(name: str, torque: Callable[[Array, Array, Array], Array]) -> tuple[Reference | None, int]:
            found = states_of_torques(torque, n, self.samples)
            reference = torque_reference(name, torque, found.states) if len(found.states.q) else None
            return reference, found.tried

        if loaded:
            way, model = next(iter(loaded.items()))
            return of(way.label, model.partial_torque)
        if functions is None:
            return None, 0
        return in_own_process(lambda: of("c", functions.torque))


def _told(name: str, reference: Reference | None, tried: int, samples: int) -> Iterator[Result]:
    """What is to be known of energies that a user wrote: what they are held against, and where."""
    if not find_spec("torch"):
        own = "a user's own, and no torch here to differentiate them: its own torques are what counts"
        yield Skipped(f"{name}: not held against their text", own)
    kept = len(reference.states.q) if reference else 0
    detail = f"numbers at {kept} of {tried} random states"
    if tried and kept < min(LEAST, samples / 2):
        yield Result(f"{name}: are defined", False, None, f"{detail}: too few to prove anything")
    elif kept < tried:
        yield Result(f"{name}: are defined", True, None, detail)


def _c_results(functions: CFunctions, name: str, references: References) -> list[Result]:
    """What each function of the C gives; a wrong one may write anywhere."""
    try:
        return in_own_process(lambda: list(functions.check(name, references)))
    except Ended as ended:
        return [Result(f"{name}: runs to its end", False, None, str(ended))]


def _line(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"
