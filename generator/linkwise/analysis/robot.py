"""A generated robot package, imported from its directory."""

import hashlib
import importlib.util
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from linkwise.analysis.poses import Body, read_skeleton
from linkwise.analysis.tensors import TensorModel
from linkwise.check.newton_euler import NewtonEuler
from linkwise.errors import LinkwiseError

Array = NDArray[np.float64]


class PackedLayout(Protocol):
    """Index rows of the packed terms: (i, j, k) joint, link, cause; or (i, j)."""

    acceleration: NDArray[np.int_]
    velocity: NDArray[np.int_]
    gravity: NDArray[np.int_]
    torque: NDArray[np.int_]


class Packed(Protocol):
    """c2, c1, g and τ_ij without the zeros, each (..., terms); the model's `layout` says which is which."""

    acceleration: Array
    velocity: Array
    gravity: Array
    torque: Array


class Propagation(Protocol):
    """Propagation torques (..., n, N, n) by order, and gravity (..., n, N)."""

    acceleration: Array
    velocity: Array
    gravity: Array


class Model(Protocol):
    """What a generated package's `load` returns, as far as the analysis uses it."""

    joint_names: Sequence[str]
    link_names: Sequence[str]
    joint_units: Sequence[str]
    layout: PackedLayout

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Joint torques τ_i (..., n)."""

    def propagation(self, q: Array, qd: Array, qdd: Array, convention: str = "closing") -> Propagation:
        """Each coefficient times its motion."""

    def packed(self, q: Array, qd: Array, qdd: Array) -> Packed:
        """All coefficients that are not identically 0."""


@dataclass(frozen=True)
class Robot:
    """A loaded robot: names in the order of every array, and which back end computes."""

    name: str
    joints: tuple[str, ...]
    units: tuple[str, ...]
    links: tuple[str, ...]
    backend: str
    model: Model
    skeleton: tuple[Body, ...] | None
    up: tuple[float, float, float]
    """Against gravity, in the base frame; z for a robot without gravity."""
    manifest_sha256: str
    recursion: NewtonEuler | None = None
    """Partial torques by an independent way; None where the energies were written by hand."""


def load_robot(directory: Path, backend: str | None = None) -> Robot:
    """Import the package in `directory`, with `backend` or the fastest that works here."""
    manifest_path = directory / "manifest.json"
    if not manifest_path.is_file():
        raise LinkwiseError(
            f"{directory}: no generated robot there (no manifest.json); make one with `linkwise generate`"
        )
    text = manifest_path.read_bytes()
    try:
        manifest: dict[str, Any] = json.loads(text)
        name, skeleton = str(manifest["name"]), read_skeleton(manifest["skeleton"])
        up = _up(manifest["conventions"].get("gravity"))
        recursion = NewtonEuler(manifest) if skeleton is not None else None
    except (ValueError, KeyError, TypeError) as error:
        raise LinkwiseError(f"{manifest_path}: damaged ({error}); generate the robot again") from error
    digest = hashlib.sha256(text).hexdigest()
    package = _import(directory, digest)
    chosen, model = _load(directory, package, package.FASTEST_FIRST if backend is None else (backend,))
    return Robot(
        name,
        tuple(model.joint_names),
        tuple(model.joint_units),
        tuple(model.link_names),
        chosen,
        model,
        skeleton,
        up,
        digest,
        recursion,
    )


def _up(gravity: Sequence[float] | None) -> tuple[float, float, float]:
    if not gravity or not any(gravity):
        return 0.0, 0.0, 1.0
    x, y, z = (-float(component) for component in gravity)
    return x, y, z


def _import(directory: Path, digest: str) -> ModuleType:
    """Import by path; the name is made of the content, so a package generated anew is read anew."""
    resolved = directory.resolve()
    name = f"linkwise_robot_{digest[:16]}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(
        name, resolved / "__init__.py", submodule_search_locations=[str(resolved)]
    )
    if spec is None or spec.loader is None or not (resolved / "__init__.py").is_file():
        raise LinkwiseError(f"{directory}: no package there (no __init__.py); generate it again")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise LinkwiseError(f"{directory}: cannot be imported: {error}; generate it again") from error
    return module


def _load(directory: Path, package: ModuleType, backends: Sequence[str]) -> tuple[str, Model]:
    reasons = []
    for backend in backends:
        try:
            model = package.load(backend)
            return backend, TensorModel(model) if model.backend.takes_tensors else model
        except Exception as error:  # A back end may lack its compiler, its library or its files.
            reasons.append(f"{backend}: {error}")
    raise LinkwiseError(
        f"{directory}: no back end for the analysis ({'; '.join(reasons)});"
        " generate the robot with --backend numpy"
    )
