"""Loading of a robot's package for analyses: a back end that works here, its ties, an oracle."""

import hashlib
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

from linkwise_runtime.dynamics import Dynamics

from linkwise.analysis.constrained_model import ConstrainedModel, tied_in_tree
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.errors import LinkwiseError
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.package.load import Package, open_package
from linkwise.package.manifest import FILE, Manifest

IN_POSITIONS, IN_VELOCITIES = re.compile(r"\bq_(\d+)\b"), re.compile(r"\bqd_(\d+)\b")
"""Coordinates, from 1, in a written constraint of positions, and those that move in one of velocities."""


def load_robot(directory: Path, backend: str | None = None, source: str = "") -> OpenedRobot:
    """Import the package in `directory`, with `backend` or the fastest that works here.

    source: the robot that a user named, where the package is kept of it, for messages

    Raises LinkwiseError for a directory without a package, a damaged one, or no back end that loads or, where
    torques depend on time or inputs, answers for samples that have their own.
    """
    package = replace(open_package(directory), source=source)
    manifest = package.manifest
    _refuse_one_value(package, backend)
    chosen, model = _load(package, _backends(package) if backend is None else (backend,))
    tree = manifest.tree
    tied = ConstrainedModel.of(model, coordinates_tied(manifest)) if manifest.tied else None
    return OpenedRobot(
        manifest.name,
        tuple(model.joint_names),
        tuple(model.joint_units),
        tuple(model.link_names),
        chosen,
        model if tied is None else cast(Dynamics, tied),
        tree,
        _up(tree.gravity if tree is not None else None),
        hashlib.sha256((directory / FILE).read_bytes()).hexdigest(),
        package,
        NewtonEuler(manifest, tree) if tree is not None else None,
        manifest.passive,
        constrained=tied,
    )


def coordinates_tied(manifest: Manifest) -> list[frozenset[int]]:
    """Return the coordinates that each row of the constraints relates."""
    if manifest.energies is None:
        return [] if manifest.tree is None else tied_in_tree(manifest.tree)
    rows = manifest.energies.constraints
    words = (IN_POSITIONS if row.holonomic else IN_VELOCITIES for row in rows)
    return [
        frozenset(int(k) - 1 for k in word.findall(row.expression))
        for row, word in zip(rows, words, strict=True)
    ]


def _is_varying(package: Package) -> bool:
    energies = package.manifest.energies
    return energies is not None and bool(energies.time or energies.inputs)


def _backends(package: Package) -> tuple[str, ...]:
    return tuple(name for name in package.fastest_first if not (name == "native" and _is_varying(package)))


def _refuse_one_value(package: Package, backend: str | None) -> None:
    """Raise LinkwiseError for a back end whose parameters have one value for all samples, where they vary."""
    if _is_varying(package) and (backend == "native" or not _backends(package)):
        raise LinkwiseError(
            f"{package.called}: its torques depend on time or inputs, which native has one value of for "
            "all samples; generate it with numpy, and leave --backend native out"
        )


def _up(gravity: Sequence[float] | None) -> tuple[float, float, float]:
    if not gravity or not any(gravity):
        return 0.0, 0.0, 1.0
    x, y, z = (-float(component) for component in gravity)
    return x, y, z


def _load(package: Package, backends: Sequence[str]) -> tuple[str, Dynamics]:
    reasons = []
    for backend in backends:
        try:
            return backend, package.load(backend)
        except Exception as error:  # A back end may lack its compiler, its library or its files.
            reasons.append(f"{backend}: {error}")
    why = "; ".join(reasons) or "the package has none"
    raise LinkwiseError(f"{package.called}: no back end for the analysis ({why}); {package.remedy}")
