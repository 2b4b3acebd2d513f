"""The checks of `linkwise check`."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from linkwise.check.as_generated import check_files, check_manifest, check_runtime
from linkwise.check.c_functions import CFunctions, compile_c
from linkwise.check.compare import Result, Skipped
from linkwise.check.compiled_c import CompiledPackage
from linkwise.check.formula_texts import check_formulas
from linkwise.check.magnitudes import Magnitudes
from linkwise.check.model_calls import Named, against_reference
from linkwise.check.newton_euler import NewtonEuler
from linkwise.check.own_process import Ended, in_own_process
from linkwise.check.packed_layout import IndexRows
from linkwise.check.parametric_tree import check_bodies, tree_with
from linkwise.check.reference import (
    Reference,
    States,
    lagrangian_reference,
    random_states,
    recursion_reference,
    torque_reference,
)
from linkwise.check.text_lagrangian import TextLagrangian
from linkwise.package.load import Model, Package, load_package, staying
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
    checks = _Checks(package, loaded, random_states(len(manifest.joints), samples))
    try:
        with staying(), np.errstate(all="ignore"):  # energies of a user's own need not be defined everywhere
            results += checks.run()
    except Exception as error:
        results.append(Result("answers", False, None, _line(error)))
    return results


def _load(package: Package) -> tuple[dict[str, Model], list[Result]]:
    if not package.backends:
        return {}, [Skipped("back ends", "nothing to load: C and formulas only")]
    loaded: dict[str, Model] = {}
    missing: list[Result] = []
    for name in package.backends:
        try:
            loaded[name] = package.load(name)
        except Exception as error:
            if _lacks(error):
                missing.append(Skipped(f"{name}: not checked", " ".join(str(error).split())))
            else:
                missing.append(Result(f"{name}: loads", False, None, _line(error)))
    if not loaded:
        missing.append(Result("back ends", False, None, "none could be loaded; nothing was checked"))
    return loaded, missing


def _lacks(error: Exception) -> bool:
    """Whether a library, the compiler or a place to compile is missing here: not the package's fault."""
    if isinstance(error, ImportError):
        library = (error.name or "").partition(".")[0]
        return library in OPTIONAL and find_spec(library) is None
    here = any(word in str(error) for word in ("install", "LINKWISE_CACHE"))
    return isinstance(error, RuntimeError) and here and " failed: " not in str(error)


@dataclass(frozen=True)
class _Checks:
    """The checks of one package's numbers: its formulas, its C, and the back ends that load here."""

    package: Package
    loaded: Mapping[str, Model]
    states: States

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
        loaded: Mapping[str, Model],
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
        reference = self._bodies(values) or self._energies(values)
        if reference is None:
            reference = self._own_reference(loaded, functions)
            yield Skipped(
                f"energies{label}",
                "a user's own, and no torch here to differentiate them: its own torques are what counts",
            )
        if reference is not None and not len(reference.states.q):
            yield Skipped(f"numbers{label}", "the energies are defined at none of the random states")
            return
        yield from check_formulas(self.package, rows, values, label, reference)
        if reference is None:
            yield Skipped(f"numbers{label}", "nothing here computes with the energies")
            return
        for result in _c_results(functions, f"c{label}", reference) if functions else ():
            c_passes &= result.passed
            yield result
        for name, model in loaded.items():
            if name == "native" and not c_passes:
                # What writes beyond its arrays takes the interpreter with it.
                yield Skipped(f"{name}{label}: not called", "its C is wrong, see above")
            else:
                yield from against_reference(Named(f"{name}{label}", model, rows, reference), manifest)

    def _other_parameters(self, rows: IndexRows, compiled: CompiledPackage | None) -> Iterator[Result]:
        """Every parameter changed a little: equal ones tell no longer one from another, and none is zero."""
        changed = _changed(self.package.manifest.parameters)
        loaded = {name: self.package.load(name, changed) for name in self.loaded}
        yield from self._numbers(", other parameters", changed, loaded, rows, compiled)

    def _bodies(self, values: Mapping[str, float]) -> Reference | None:
        manifest = self.package.manifest
        if manifest.tree is None:
            return None
        tree = tree_with(manifest.tree, values)
        return recursion_reference(NewtonEuler(manifest, tree), Magnitudes(manifest, tree), self.states)

    def _energies(self, values: Mapping[str, float]) -> Reference | None:
        """The energies that a user wrote, from the manifest's text; None without torch."""
        energies = self.package.manifest.energies
        if energies is None or find_spec("torch") is None:
            return None
        return lagrangian_reference([TextLagrangian(entry, values) for entry in energies], self.states)

    def _own_reference(self, loaded: Mapping[str, Model], functions: CFunctions | None) -> Reference | None:
        """The torques of one of the package's back ends, else those of its C."""
        for name, model in loaded.items():
            return torque_reference(name, model.partial_torque, self.states)
        if functions is None:
            return None
        return in_own_process(lambda: torque_reference("c", functions.torque, self.states))


def _c_results(functions: CFunctions, name: str, reference: Reference) -> list[Result]:
    """What each function of the C gives; a wrong one may write anywhere."""
    try:
        return in_own_process(lambda: list(functions.check(name, reference)))
    except Ended as ended:
        return [Result(f"{name}: runs to its end", False, None, str(ended))]


def _changed(values: Mapping[str, float]) -> dict[str, float]:
    """Each value changed by up to 3 % of its own; a zero, by 1 to 3 % of the smallest of its kind.

    Of a kind are names that begin alike: masses m_…, centres of mass c_…, inertias I_….
    """
    generator = np.random.default_rng(2)
    smallest: dict[str, float] = {}
    for name, value in values.items():
        if value:
            kind = name.partition("_")[0]
            smallest[kind] = min(abs(value), smallest.get(kind, np.inf))
    return {
        name: value * generator.uniform(0.97, 1.03)
        or smallest.get(name.partition("_")[0], 1.0) * generator.uniform(0.01, 0.03)
        for name, value in values.items()
    }


def _line(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"
