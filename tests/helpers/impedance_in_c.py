"""Partial impedance of the emitted C through the functions of its header, and its formulas in NumPy."""

import ctypes
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from linkwise.package.manifest import Manifest

from helpers.compiled import compile_library, name_of

Given = Mapping[str, Any]
"""keep_inertia, inertia, keep_velocity, damping, stiffness, regular, friction_width; of a frame also rows and
point."""


class ImpedanceInC:
    """Functions of a package, compiled with both number types; `parameters` are those at run time."""

    def __init__(
        self, directory: Path, target: Path, parameters: Any = (), flags: Sequence[str] = ()
    ) -> None:
        self.name, self.parameters = name_of(directory), parameters
        compile_library(directory, target, ("gcc", "-std=c99", *flags))
        self.library = ctypes.CDLL(str(target))
        tree = Manifest.read(directory).tree
        self.frames = [frame.name for frame in tree.frames] if tree else []

    def joints(
        self,
        q: Any,
        qd: Any,
        given: Given | None = None,
        to: Any = (None, None, None),
        task: Any = None,
        external: Any = None,
        dtype: Any = np.float64,
        follows: Any = None,
    ) -> tuple[int, Any]:
        """Return what the function for joints returns, and tau; `to` is q_d, qd_d, qdd_d.

        follows: array that the acceleration is written to
        """
        wanted, kept = joint_struct(given, dtype)
        asked = (wanted, *to, task, external)
        return self._call("partial_impedance", (q, qd), asked, len(q), dtype, kept, [follows])

    def cancelled(
        self, q: Any, qd: Any, qdd: Any, given: Given | None, task: Any = None, dtype: Any = np.float64
    ) -> Any:
        """Return what is cancelled at an acceleration."""
        wanted, kept = joint_struct(given, dtype)
        refused, tau = self._call("cancel", (q, qd, qdd), (wanted, task), len(q), dtype, kept)
        assert refused == 0
        return tau

    def frame(
        self,
        q: Any,
        qd: Any,
        frame: str,
        given: Given,
        target: Any = (None, None, None),
        posture: Given | None = None,
        to: Any = (None, None, None),
        external: Any = None,
        dtype: Any = np.float64,
        follows: Any = None,
    ) -> tuple[int, Any]:
        """Return what the function for a frame returns, and tau; `target` is its pose, velocity and
        acceleration."""
        of_joints, kept = joint_struct(posture, dtype)
        of_frame, kept_too = frame_struct(self.frames.index(frame), given, dtype)
        arguments = (of_joints, *to, of_frame, *target, external)
        every = [*kept, *kept_too]
        return self._call("frame_partial_impedance", (q, qd), arguments, len(q), dtype, every, [follows])

    def _call(
        self,
        function: str,
        state: Any,
        arguments: Any,
        n: int,
        dtype: Any,
        kept: list[Any],
        follows: Sequence[Any] = (),
    ) -> tuple[int, Any]:
        tau = np.full(n, 7.0, dtype)
        entry = getattr(self.library, f"{self.name}_{function}{_suffix(dtype)}")
        motion = [*state, *([self.parameters] if len(self.parameters) else [])]
        pointers = [pointer_to(a, dtype, kept) for a in (*motion, *arguments)]
        written = [ctypes.c_void_p(None if a is None else a.ctypes.data) for a in (tau, *follows)]
        return entry(*pointers, *written), tau


def formula(model: Any, q: Any, qd: Any, given: Given, to: Any, task: Any, external: Any) -> Any:
    """qdd and tau as the header has them: H, M*, B* are sums over the links, written out."""
    natural = Natural(model, q, qd)
    force = natural.zeros if external is None else external
    qdd = natural.followed(given, to, force if task is None else force + task)
    return qdd, natural.torque(qdd, given) - force


def cancel_formula(model: Any, q: Any, qd: Any, qdd: Any, given: Given, task: Any) -> Any:
    """Torques of what is not kept at qdd, and of what is there at rest."""
    natural = Natural(model, q, qd)
    inertia, damping = natural.wanted(given)
    kept = inertia @ qdd + damping @ qd
    return natural.torque(qdd, given) - kept + (0.0 if task is None else task)


def frame_formula(
    model: Any, q: Any, qd: Any, frame: str, given: Given, target: Any, posture: Given, to: Any, external: Any
) -> Any:
    """qdd and tau of a frame, as the header has them."""
    natural = Natural(model, q, qd)
    rows, point = given.get("rows", range(6)), np.array(given.get("point", np.zeros(3)))
    chosen = np.array(rows)
    force = natural.zeros if external is None else external
    j = model.kinematics.jacobian(q, frame, point)[chosen]
    rate = model.kinematics.jacobian_rate(q, qd, frame, point)[chosen]
    inverse = np.linalg.inv(natural.inertia)
    inertia = np.linalg.inv(j @ inverse @ j.T)
    dual = inverse @ j.T @ inertia
    mu = inertia @ (j @ inverse @ natural.velocity - rate) @ dual
    wanted_inertia = given.get("keep_inertia", 1.0) * inertia + given.get("inertia", 0.0)
    wanted_damping = given.get("keep_velocity", 1.0) * mu + given.get("damping", 0.0)
    pose, velocity, acceleration = target
    away = j @ qd - (0.0 if velocity is None else velocity[chosen])
    pull = dual.T @ force - wanted_damping @ away
    if "stiffness" in given:
        here = model.kinematics.pose(q, frame)
        theta = rotation_vector(here[:3, :3] @ pose[:3, :3].T)
        whole = np.eye(6)
        whole[:3, :3] = np.linalg.inv(left_jacobian(theta))
        x = np.r_[theta, (here - pose) @ np.r_[point, 1.0]][np.r_[:6]]
        pull = pull - whole[np.ix_(chosen, chosen)].T @ given["stiffness"] @ x[chosen]
    wanted = (0.0 if acceleration is None else acceleration[chosen]) + np.linalg.solve(wanted_inertia, pull)
    first = natural.followed(posture, to, force)
    qdd = first + dual @ (wanted - rate @ qd - j @ first)
    return qdd, natural.torque(qdd, posture) - force


class Natural:
    """Equation of motion of the robot's joints at a state."""

    def __init__(self, model: Any, q: Any, qd: Any) -> None:
        self.c2, self.c1, g = model.coefficients(q, qd)
        stiffness, pull, damping, friction, armature = map(np.array, model.structure.passive_sums)
        self.q, self.qd, self.zeros, self.armature = q, qd, np.zeros(len(q)), np.diag(armature)
        self.inertia, self.velocity = self.c2.sum(1) + self.armature, self.c1.sum(1)
        self.rest, self.friction = g.sum(1) + stiffness * q + pull + damping * qd, friction

    def followed(self, given: Given, to: Any, force: Any) -> Any:
        """q̈* of what is wanted of the joints."""
        q_d, qd_d, qdd_d = (self.zeros if a is None else a for a in to)
        inertia, damping = self.wanted(given)
        pull = force - damping @ (self.qd - qd_d)
        if "stiffness" in given:
            pull = pull - given["stiffness"] @ (self.q - q_d)
        return qdd_d + np.linalg.solve(inertia, pull)

    def wanted(self, given: Given) -> tuple[Any, Any]:
        """M* and B*."""
        ones = np.ones_like(self.c2)
        inertia = (given.get("keep_inertia", ones) * self.c2).sum(1) + self.armature
        damping = (given.get("keep_velocity", ones) * self.c1).sum(1)
        return inertia + given.get("inertia", 0.0), damping + given.get("damping", 0.0)

    def torque(self, qdd: Any, given: Given) -> Any:
        """Return the torque that the motion asks of the joints, and the wanted part of their friction."""
        width = given.get("friction_width", 0.0)
        rubbed = self.friction * np.tanh(self.qd / width) if width else 0.0
        return self.inertia @ qdd + self.velocity @ self.qd + self.rest + rubbed


def rotation_vector(turn: Any) -> Any:
    """Return the rotation vector by the eigenvectors of a rotation matrix: the axis is that of eigenvalue
    1."""
    values, vectors = np.linalg.eig(turn)
    axis = np.real(vectors[:, np.argmin(np.abs(values - 1.0))])
    angle = np.arccos(np.clip((np.trace(turn) - 1.0) / 2.0, -1.0, 1.0))
    twice = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return axis * np.sign(axis @ twice) * angle


def left_jacobian(theta: Any) -> Any:
    """The series sum of [theta]^k / (k + 1)!."""
    x, y, z = theta
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    term, total = np.eye(3), np.eye(3)
    for k in range(2, 60):
        term = term @ cross / k
        total = total + term
    return total


def _suffix(dtype: Any) -> str:
    return "f" if dtype == np.float32 else ""


def pointer_to(value: Any, dtype: Any, kept: list[Any]) -> Any:
    if value is None or isinstance(value, ctypes.Structure):
        return None if value is None else ctypes.byref(value)
    kept.append(np.ascontiguousarray(value, dtype))
    return ctypes.c_void_p(kept[-1].ctypes.data)


def joint_struct(given: Given | None, dtype: Any) -> tuple[Any, list[Any]]:
    """NAME_impedance, and the arrays that it points to."""
    if given is None:
        return None, []
    names, kept = ("keep_inertia", "inertia", "keep_velocity", "damping", "stiffness"), list[Any]()
    real = ctypes.c_float if dtype == np.float32 else ctypes.c_double
    fields = [*((name, ctypes.c_void_p) for name in names), ("regular", ctypes.c_int)]
    fields += [("friction_width", real)]  # which C has where joints have anything of their own
    kind = type("Impedance", (ctypes.Structure,), {"_fields_": fields})
    pointers = [pointer_to(given.get(name), dtype, kept) for name in names]
    return kind(*pointers, given.get("regular", 0), given.get("friction_width", 0.0)), kept


def frame_struct(frame: int, given: Given, dtype: Any) -> tuple[Any, list[Any]]:
    """NAME_frame_impedance, and the arrays that it points to."""
    real, kept = ctypes.c_float if dtype == np.float32 else ctypes.c_double, list[Any]()
    names = ("inertia", "damping", "stiffness")
    fields = [("frame", ctypes.c_int), ("point", ctypes.c_void_p), ("rows", ctypes.c_int)]
    fields += [("row", ctypes.c_void_p), ("keep_inertia", real), ("keep_velocity", real)]
    fields += [(name, ctypes.c_void_p) for name in names]
    kind = type("FrameImpedance", (ctypes.Structure,), {"_fields_": fields})
    rows = np.array(given.get("rows", range(6)), np.intc)
    kept.append(rows)
    point = pointer_to(given.get("point"), dtype, kept)
    pointers = [pointer_to(given.get(name), dtype, kept) for name in names]
    shares = (given.get("keep_inertia", 1.0), given.get("keep_velocity", 1.0))
    return kind(frame, point, len(rows), rows.ctypes.data, *shares, *pointers), kept
