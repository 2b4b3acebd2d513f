"""The checks of `linkwise check`."""

import hashlib
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from linkwise.check.compare import (
    Motion,
    Oracle,
    against_oracle,
    agreement,
    difference_oracle,
    recursion_oracle,
    structure,
)
from linkwise.check.newton_euler import Array
from linkwise.check.result import Result, Skipped
from linkwise.package.load import import_package
from linkwise.package.manifest import read_manifest


def check_package(directory: Path, samples: int = 100) -> list[Result]:
    """Run every check on a package; raises LinkwiseError when `directory` holds none that can be read."""
    manifest = read_manifest(directory)
    results = [_hashes(directory, manifest)]
    if not results[0].passed:
        return results
    try:
        package = import_package(directory)
    except Exception as error:
        return [*results, Result("import", False, None, _line(error))]
    loaded, missing = _load(package)
    results += missing
    if not loaded:
        return results
    generator, shape = np.random.default_rng(0), (samples, len(manifest["joints"]))
    q = generator.uniform(-np.pi, np.pi, shape)
    motion = Motion(q, *generator.uniform(-2.0, 2.0, (2, *shape)))
    try:
        results += _numbers(manifest, loaded, motion)
    except Exception as error:
        results.append(Result("answers", False, None, _line(error)))
    return results


def _hashes(directory: Path, manifest: dict[str, Any]) -> Result:
    wrong = [] if manifest["files"] else ["the manifest lists no files"]
    for path, digest in manifest["files"].items():
        file = directory / path
        if not file.is_file():
            wrong.append(f"{path} is missing")
        elif hashlib.sha256(file.read_bytes()).hexdigest() != digest:
            wrong.append(f"{path} was changed")
    known = {"manifest.json", *manifest["files"]}
    for file in sorted(directory.rglob("*")):
        relative = file.relative_to(directory)
        if file.is_dir() or "__pycache__" in relative.parts or relative.as_posix() in known:
            continue
        wrong.append(f"{relative.as_posix()} was added")
    detail = "; ".join(wrong[:3]) if wrong else f"{len(manifest['files'])} files as generated"
    return Result("hashes", not wrong, None, detail)


class _Answers:
    """A loaded back end, asked with and answering in NumPy arrays."""

    def __init__(self, dynamics: Any) -> None:
        self.dynamics, self.tensors = dynamics, dynamics.backend.takes_tensors

    def __call__(self, call: str, *motion: Array) -> Any:
        if not self.tensors:
            return getattr(self.dynamics, call)(*motion)
        import torch

        answer = getattr(self.dynamics, call)(*(torch.from_numpy(m) for m in motion))
        if isinstance(answer, tuple):
            return type(answer)(*(a.numpy() if torch.is_tensor(a) else a for a in answer))
        return answer.numpy()


def _load(package: ModuleType) -> tuple[dict[str, _Answers], list[Result]]:
    if not package.BACKENDS:
        return {}, [Skipped("back ends", "nothing to load: C and formulas only; their hashes were checked")]
    loaded: dict[str, _Answers] = {}
    missing: list[Result] = []
    for name in package.BACKENDS:
        try:
            loaded[name] = _Answers(package.load(name))
        except Exception as error:
            if _lacks(error, package.__name__):
                missing.append(Skipped(f"{name}: not checked", " ".join(str(error).split())))
            else:
                missing.append(Result(f"{name}: loads", False, None, _line(error)))
    if not loaded:
        missing.append(Result("back ends", False, None, "none could be loaded; nothing was checked"))
    return loaded, missing


def _lacks(error: Exception, package: str) -> bool:
    """Whether a library or the compiler is missing here, which is no fault of the package."""
    if isinstance(error, ImportError):
        return not (error.name or "").startswith(package)
    return isinstance(error, RuntimeError) and "install" in str(error) and " failed: " not in str(error)


def _numbers(manifest: dict[str, Any], loaded: dict[str, _Answers], motion: Motion) -> Iterator[Result]:
    oracle = _oracle(manifest, loaded, motion)
    for name, answers in loaded.items():
        yield from against_oracle(name, answers, oracle, motion)
        yield from structure(name, answers, manifest, motion)
    for (name, answers), (other_name, other) in combinations(loaded.items(), 2):
        yield from agreement(name, answers, other_name, other, motion)


def _oracle(manifest: dict[str, Any], loaded: dict[str, _Answers], motion: Motion) -> Oracle | None:
    if manifest["skeleton"] is not None:
        return recursion_oracle(manifest, motion)
    backends = [answers.dynamics.backend for answers in loaded.values()]
    lagrangians = next((backend.modules for backend in backends if hasattr(backend, "modules")), None)
    return None if lagrangians is None else difference_oracle(lagrangians, motion)


def _line(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"
