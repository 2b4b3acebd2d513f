"""The checks of `linkwise check`."""

from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import numpy as np

from linkwise.check.as_generated import check_files, check_manifest
from linkwise.check.compare import (
    Oracle,
    Result,
    Skipped,
    States,
    against_oracle,
    agreement,
    difference_oracle,
    recursion_oracle,
    structure,
)
from linkwise.check.newton_euler import NewtonEuler
from linkwise.package.load import Model, Package, load_package
from linkwise.package.manifest import Manifest


def check_package(directory: Path, samples: int = 100) -> list[Result]:
    """Run every check on a package; raises LinkwiseError when `directory` holds none that can be read."""
    manifest = Manifest.read(directory)
    results = check_files(directory, manifest)
    if not results[0].passed:
        return results
    try:
        package = load_package(directory, manifest)
        results.append(check_manifest(package))
    except Exception as error:
        return [*results, Result("import", False, None, _line(error))]
    if not results[-1].passed:
        return results
    loaded, missing = _load(package)
    results += missing
    if not loaded:
        return results
    generator, shape = np.random.default_rng(0), (samples, len(manifest.joints))
    q = generator.uniform(-np.pi, np.pi, shape)
    states = States(q, *generator.uniform(-2.0, 2.0, (2, *shape)))
    try:
        results += _numbers(package, loaded, states)
    except Exception as error:
        results.append(Result("answers", False, None, _line(error)))
    return results


def _load(package: Package) -> tuple[dict[str, Model], list[Result]]:
    if not package.backends:
        return {}, [Skipped("back ends", "nothing to load: C and formulas only; their hashes were checked")]
    loaded: dict[str, Model] = {}
    missing: list[Result] = []
    for name in package.backends:
        try:
            loaded[name] = package.load(name)
        except Exception as error:
            if _lacks(error, package.module.__name__):
                missing.append(Skipped(f"{name}: not checked", " ".join(str(error).split())))
            else:
                missing.append(Result(f"{name}: loads", False, None, _line(error)))
    if not loaded:
        missing.append(Result("back ends", False, None, "none could be loaded; nothing was checked"))
    return loaded, missing


def _lacks(error: Exception, package: str) -> bool:
    """Whether a library or the compiler is missing here, which is not the package's fault."""
    if isinstance(error, ImportError):
        return not (error.name or "").startswith(package)
    return isinstance(error, RuntimeError) and "install" in str(error) and " failed: " not in str(error)


def _numbers(package: Package, loaded: dict[str, Model], states: States) -> Iterator[Result]:
    oracle = _oracle(package, loaded, states)
    for name, model in loaded.items():
        yield from against_oracle(name, model, oracle, states)
        yield from structure(name, model, package.manifest, states)
    for (name, model), (other_name, other) in combinations(loaded.items(), 2):
        yield from agreement(name, model, other_name, other, states)


def _oracle(package: Package, loaded: dict[str, Model], states: States) -> Oracle | None:
    manifest = package.manifest
    if manifest.tree is not None:
        return recursion_oracle(NewtonEuler(manifest, manifest.tree), states)
    backends = [model.backend for model in loaded.values()]
    lagrangians = next((backend.modules for backend in backends if hasattr(backend, "modules")), None)
    return None if lagrangians is None else difference_oracle(lagrangians, states)


def _line(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"
