"""Pinocchio beside us: rnea() of the robot, the full decomposition and tau_ij alone by its best recipes."""

import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from speed.package import PEERS, Package, build_flags, run
from speed.rounds import by_turns

BOOST = (
    "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
    "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30",
    "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
    "-DBOOST_FUSION_INVOKE_MAX_ARITY=12",
)
"""Limits of Pinocchio's own CMake files: its joint types are more than Boost's lists hold by default."""


@dataclass(frozen=True)
class Peer:
    """Nanoseconds for one sample, how they were measured, and the largest difference from our torques.

    regressor: tau_ij alone, by computeJointTorqueRegressor and each link's ten parameters
    """

    how: str
    rnea: float
    decomposition: float
    regressor: float
    difference: float

    def best_of(self, other: "Peer | None") -> "Peer":
        """The least of two rounds."""
        if other is None:
            return self
        times = (min(a, b) for a, b in zip(self.times, other.times, strict=True))
        return Peer(self.how, *times, max(self.difference, other.difference))

    @property
    def times(self) -> tuple[float, float, float]:
        """The three figures."""
        return self.rnea, self.decomposition, self.regressor


def headers() -> list[Path] | None:
    """Directories with Pinocchio's, Boost's and Eigen's headers, if all are there."""
    packages = [Path(folder) for folder in sys.path]
    prefixes = [folder / "cmeel.prefix" / "include" for folder in packages]
    eigen = [
        *(prefix / "eigen3" for prefix in prefixes),
        *(folder / "casadi" / "include" / "eigen3" for folder in packages),
        Path("/usr/include/eigen3"),
        Path("/usr/local/include/eigen3"),
    ]
    prefix = next((p for p in prefixes if (p / "pinocchio").is_dir() and (p / "boost").is_dir()), None)
    found = next((path for path in eigen if (path / "Eigen" / "Core").exists()), None)
    return None if prefix is None or found is None else [prefix, found]


def binary(work: Path) -> Path | None:
    """Compile the C++ program; None where a compiler or headers are missing."""
    include = headers()
    compiler = next((c for c in ("c++", "g++", "clang++") if shutil.which(c)), None)
    if include is None or compiler is None:
        return None
    program = work / "pinocchio_peer"
    source = PEERS / "pinocchio.cpp"
    if not program.exists() or program.stat().st_mtime < source.stat().st_mtime:
        flags = ["-std=c++17", *build_flags(), *BOOST, "-DNDEBUG", "-w", *(f"-I{path}" for path in include)]
        try:
            run([compiler, *flags, str(source), "-o", str(program)])
        except RuntimeError as error:
            print(f"Pinocchio from Python, as its C++ did not compile: {str(error)[:200]}")
            return None
    return program


def measure(package: Package, work: Path) -> Peer:
    """Time Pinocchio on this robot, in C++ if possible."""
    program = binary(work)
    n = package.sizes["JOINTS"]
    ours = package.module().load("numpy").packed_torque(*np.tile(0.1 * np.arange(1, n + 1), (3, 1)))
    if program is None:
        return from_python(package, ours)
    lines = dict(line.split(" ", 1) for line in run([str(program)], description(package)).splitlines())
    theirs = [np.array(lines[name].split(), dtype=float) for name in ("tau", "split")]
    difference = max(float(np.abs(tau - ours).max()) for tau in theirs)
    return Peer("C++", *(float(lines[name]) for name in ("rnea", "decomposition", "regressor")), difference)


def description(package: Package) -> str:
    """The robot as peers/pinocchio.cpp reads it."""
    tree = package.manifest["tree"]
    lines = [" ".join(map(repr, [len(tree["joints"]), *tree["gravity"]]))]
    for k, (joint, link) in enumerate(zip(tree["joints"], tree["links"], strict=True)):
        if joint["coordinate"] != k or joint["ratio"] != 1.0:
            raise ValueError(f"{package.name}: the peer knows only one joint of its own for each link")
        numbers = [*np.ravel(joint["rotation"]), *joint["translation"], link["mass"], *link["com"]]
        parent = -1 if joint["parent"] is None else joint["parent"]
        text = " ".join(repr(float(x)) for x in [*numbers, *np.ravel(link["inertia"])])
        lines.append(f"{parent} {joint['kind']} {text}")
    return "\n".join([*lines, ""])


def chain(package: Package, links: list[int], only: int | None) -> Any:
    """Pinocchio's model of these links' joints; with the inertia of one link, or of all."""
    import pinocchio as pin

    model, index = pin.Model(), {}
    tree = package.manifest["tree"]
    for j in links:
        joint, link = tree["joints"][j], tree["links"][j]
        made = pin.JointModelPZ() if joint["kind"] == "prismatic" else pin.JointModelRZ()
        place = pin.SE3(np.array(joint["rotation"]), np.array(joint["translation"]))
        index[j] = model.addJoint(index.get(joint["parent"], 0), made, place, str(j))
        if only in (None, j):
            body = pin.Inertia(link["mass"], np.array(link["com"]), np.array(link["inertia"]))
            model.appendBodyToJoint(index[j], body, pin.SE3.Identity())
    model.gravity.linear = np.array(package.manifest["tree"]["gravity"])
    return model


def from_python(package: Package, ours: Any) -> Peer:
    """Return the peer that goes by the same recipe through Pinocchio's Python."""
    import pinocchio as pin

    paths = [link["path"] for link in package.manifest["links"]]
    whole = chain(package, list(range(len(paths))), None)
    chains = [chain(package, path, j) for j, path in enumerate(paths)]
    data, parts = whole.createData(), [(m, m.createData()) for m in chains]
    x = 0.1 * np.arange(1, whole.nv + 1)
    motions = [x[path] for path in paths]

    def decomposition() -> None:
        for (model, store), y in zip(parts, motions, strict=True):
            pin.rnea(model, store, y, y, y)
            pin.crba(model, store, y)
            pin.computeCoriolisMatrix(model, store, y, y)
            pin.computeGeneralizedGravity(model, store, y)

    split = regressor(package)
    tau = np.concatenate([pin.rnea(*part, y, y, y) for part, y in zip(parts, motions, strict=True)])
    by_regressor = np.concatenate([split()[path, j] for j, path in enumerate(paths)])
    difference = max(float(np.abs(found - ours).max()) for found in (tau, by_regressor))
    calls = {"rnea": lambda: pin.rnea(whole, data, x, x, x), "all": decomposition, "regressor": split}
    ns = by_turns(calls, 0.3)
    return Peer("Python", ns["rnea"], ns["all"], ns["regressor"], difference)


def calls_from_python(package: Package) -> dict[str, Callable[[], Any]]:
    """Pinocchio's calls for one sample from Python: rnea, the sums, and its recipe for tau_ij."""
    import pinocchio as pin

    whole = chain(package, list(range(package.sizes["JOINTS"])), None)
    data, x = whole.createData(), 0.1 * np.arange(1, whole.nv + 1)
    return {"rnea": partial(pin.rnea, whole, data, x, x, x), "regressor": regressor(package)}


def regressor(package: Package) -> Callable[[], Any]:
    """computeJointTorqueRegressor times each link's ten parameters: every tau_ij, (n, N)."""
    import pinocchio as pin

    whole = chain(package, list(range(package.sizes["JOINTS"])), None)
    data, n = whole.createData(), whole.nv
    x = 0.1 * np.arange(1, n + 1)
    bodies = np.stack([whole.inertias[j + 1].toDynamicParameters() for j in range(n)])

    def split() -> Any:
        found = pin.computeJointTorqueRegressor(whole, data, x, x, x)
        return (found.reshape(n, n, 10) * bodies).sum(-1)

    return split
