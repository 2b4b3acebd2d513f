"""The checks of `linkwise check`."""

import hashlib
import importlib.util
import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from linkwise.check.newton_euler import Array, NewtonEuler
from linkwise.errors import LinkwiseError

TOLERANCE = 1e-9
"""Largest relative error that passes; float64 leaves some 1e-13 for an arm."""

DIFFERENCE_TOLERANCE = 1e-5
"""The same against finite differences of a Lagrangian."""


@dataclass(frozen=True)
class Result:
    """One check: its name, whether it passed, the largest error (None: not a number's matter), and a line."""

    name: str
    passed: bool
    error: float | None
    detail: str


def check_package(directory: Path, samples: int = 100) -> list[Result]:
    """Run every check on a package; raises LinkwiseError when `directory` holds none that can be read."""
    manifest = read_manifest(directory)
    results = [_hashes(directory, manifest)]
    if not results[0].passed:
        return results
    package = import_package(directory)
    generator = np.random.default_rng(0)
    n = len(manifest["joints"])
    q = generator.uniform(-np.pi, np.pi, (samples, n))
    qd, qdd = generator.uniform(-2.0, 2.0, (2, samples, n))
    loaded, missing = _load(package)
    results += missing
    if not loaded:
        return results
    oracle = _oracle(manifest, loaded, q, qd, qdd)
    for name, answers in loaded.items():
        results += list(_against_oracle(name, answers, oracle, q, qd, qdd))
        results += list(_structure(name, answers, manifest, q, qd, qdd))
    names = list(loaded)
    for a, name in enumerate(names):
        for other in names[a + 1 :]:
            results += list(_agreement(name, loaded[name], other, loaded[other], q, qd, qdd))
    return results


def read_manifest(directory: Path) -> dict[str, Any]:
    """Return a package's manifest; raises LinkwiseError when there is none that can be read."""
    path = directory / "manifest.json"
    if not path.is_file():
        raise LinkwiseError(f"{directory} holds no manifest.json; give the directory of a generated package")
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise LinkwiseError(f"{path} is no JSON ({error}); generate the package again") from None
    if not isinstance(data, dict) or data.get("schema") != 1 or not isinstance(data.get("files"), dict):
        raise LinkwiseError(f"{path} has another schema; generate the package again")
    return data


def import_package(directory: Path) -> ModuleType:
    """Import a package from its directory, under a name of its own; nothing is put on sys.path."""
    path = directory.resolve()
    digest = hashlib.sha256(str(path).encode() + (path / "manifest.json").read_bytes()).hexdigest()[:16]
    name = f"_linkwise_{digest}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(
        name, path / "__init__.py", submodule_search_locations=[str(path)]
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def _hashes(directory: Path, manifest: dict[str, Any]) -> Result:
    wrong = []
    for path, digest in manifest["files"].items():
        file = directory / path
        if not file.is_file():
            wrong.append(f"{path} is missing")
        elif hashlib.sha256(file.read_bytes()).hexdigest() != digest:
            wrong.append(f"{path} was changed")
    detail = "; ".join(wrong[:3]) if wrong else f"{len(manifest['files'])} files as generated"
    return Result("hashes", not wrong, None, detail)


class _Answers:
    """A loaded back end, asked with and answering in NumPy arrays."""

    def __init__(self, dynamics: Any) -> None:
        self.dynamics, self.tensors = dynamics, dynamics.backend.name in ("torch", "autograd")

    def __call__(self, call: str, *motion: Array) -> Any:
        if not self.tensors:
            return getattr(self.dynamics, call)(*motion)
        import torch

        answer = getattr(self.dynamics, call)(*(torch.from_numpy(m) for m in motion))
        if isinstance(answer, tuple):
            return type(answer)(*(a.numpy() if torch.is_tensor(a) else a for a in answer))
        return answer.numpy()


def _load(package: ModuleType) -> tuple[dict[str, _Answers], list[Result]]:
    loaded, missing = {}, []
    for name in package.BACKENDS:
        try:
            loaded[name] = _Answers(package.load(name))
        except (ImportError, RuntimeError) as error:
            # A library that is not installed here is no fault of the package; a part of its own is.
            lacking = not (getattr(error, "name", None) or "").startswith(package.__name__)
            missing.append(Result(f"{name}: not checked", lacking, None, " ".join(str(error).split())))
    if not loaded:
        missing.append(Result("back ends", False, None, "none could be loaded; nothing was checked"))
    return loaded, missing


@dataclass(frozen=True)
class _Oracle:
    name: str
    tolerance: float
    tau: Array
    mass: Array | None


def _oracle(
    manifest: dict[str, Any], loaded: dict[str, _Answers], q: Array, qd: Array, qdd: Array
) -> _Oracle | None:
    if manifest["skeleton"] is not None:
        recursion = NewtonEuler(manifest)
        columns = [
            recursion.partial_torque(q, 0 * qd, np.broadcast_to(unit, q.shape), gravity=False)
            for unit in np.eye(recursion.n)
        ]
        tau = recursion.partial_torque(q, qd, qdd)
        return _Oracle("Newton-Euler recursion", TOLERANCE, tau, np.stack(columns, -1))
    if "autograd" not in loaded:
        return None
    from linkwise.check.finite_difference import partial_torque

    modules = loaded["autograd"].dynamics.backend.modules
    tau = partial_torque(modules, q, qd, qdd)
    return _Oracle("finite differences of L", DIFFERENCE_TOLERANCE, tau, None)


def _compare(name: str, value: Array, reference: Array, tolerance: float = TOLERANCE) -> Result:
    scale = max(float(np.abs(reference).max(initial=0.0)), 1e-300)
    error = float(np.abs(value - reference).max(initial=0.0)) / scale
    return Result(name, bool(error <= tolerance), error, f"largest relative error {error:.1e}")


def _against_oracle(
    name: str, ask: _Answers, oracle: _Oracle | None, q: Array, qd: Array, qdd: Array
) -> Iterator[Result]:
    if oracle is None:
        yield Result(
            f"{name}: oracle",
            True,
            None,
            "none: energies of a user's own need the autograd back end",
        )
        return
    tau = ask("partial_torque", q, qd, qdd)
    yield _compare(f"{name}: tau_ij against {oracle.name}", tau, oracle.tau, oracle.tolerance)
    total = ask("inverse_dynamics", q, qd, qdd)
    yield _compare(f"{name}: tau_i against {oracle.name}", total, oracle.tau.sum(-1), oracle.tolerance)
    if oracle.mass is not None:
        mass = ask("coefficients", q, qd).acceleration
        yield _compare(f"{name}: M^j against {oracle.name}", mass, oracle.mass)


def _structure(
    name: str, ask: _Answers, manifest: dict[str, Any], q: Array, qd: Array, qdd: Array
) -> Iterator[Result]:
    tau = ask("partial_torque", q, qd, qdd)
    parts = ask("propagation", q, qd, qdd)
    closed = parts.acceleration.sum(-1) + parts.velocity.sum(-1) + parts.gravity
    yield _compare(f"{name}: decomposition closes to tau_ij", closed, tau)
    off = np.ones(tau.shape[1:], dtype=bool)
    for j, link in enumerate(manifest["links"]):
        off[link["path"], j] = False
    error = float(np.abs(tau[:, off]).max(initial=0.0))
    yield Result(f"{name}: tau_ij = 0 off the path", error == 0.0, error, f"largest value {error:.1e}")
    mass = ask("coefficients", q, qd).acceleration
    yield _compare(f"{name}: M^j symmetric", mass, np.swapaxes(mass, 1, 3))
    smallest = float(np.linalg.eigvalsh(mass.sum(2)).min())
    unphysical = bool(manifest["request"].get("allow_unphysical")) or manifest["skeleton"] is None
    detail = f"smallest eigenvalue {smallest:.1e}"
    yield Result(f"{name}: total mass matrix positive definite", smallest > 0 or unphysical, smallest, detail)


def _agreement(
    name: str, one: _Answers, other_name: str, other: _Answers, q: Array, qd: Array, qdd: Array
) -> Iterator[Result]:
    for call, motion in (
        ("partial_torque", (q, qd, qdd)),
        ("coefficients", (q, qd)),
        ("position_gradient", (q, qd, qdd)),
    ):
        a, b = one(call, *motion), other(call, *motion)
        fields = zip(("c2", "c1", "g"), a, b, strict=False) if isinstance(a, tuple) else [("", a, b)]
        for field, x, y in fields:
            what = field or {"partial_torque": "tau_ij", "position_gradient": "c0"}[call]
            yield _compare(f"{name} against {other_name}: {what}", x, y)
