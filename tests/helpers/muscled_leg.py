"""A leg of OpenSim's with four muscles: straight, over a cylinder, by a moving and by a conditional point."""

from pathlib import Path
from typing import Any

import numpy as np

COORDINATES = ("slide", "hip", "knee", "ankle")
MUSCLES = ("straight", "wrapping", "moving", "conditional")
RESERVE = "knee_reserve"
PLACES = ((0.05, 0.02, 0.06), (-0.04, -0.1, 0.05), (0.03, -0.2, -0.05))
"""Places of the markers on each body."""


def built(osim: Any, path: Path) -> None:
    """Write the model; osim: the module of OpenSim."""
    model = osim.Model()
    model.setName("leg")
    bodies = [
        osim.Body(name, mass, osim.Vec3(0, y, 0), osim.Inertia(i, i / 4, i))
        for name, mass, y, i in (
            ("pelvis", 11.0, 0.1, 0.1),
            ("thigh", 9.0, -0.2, 0.13),
            ("shank", 3.5, -0.2, 0.05),
            ("foot", 1.2, -0.03, 0.01),
        )
    ]
    for body in bodies:
        model.addBody(body)
    zero, below = osim.Vec3(0), osim.Vec3(0, -0.42, 0)
    slider = osim.SliderJoint("ground_pelvis", model.getGround(), zero, zero, bodies[0], zero, zero)
    joints = [slider] + [
        osim.PinJoint(name, bodies[at], zero if at == 0 else below, zero, bodies[at + 1], zero, zero)
        for at, name in enumerate(("hip_joint", "knee_joint", "ankle_joint"))
    ]
    for joint, name in zip(joints, COORDINATES, strict=True):
        joint.updCoordinate().setName(name)
        model.addJoint(joint)
    cylinder = osim.WrapCylinder()
    cylinder.setName("condyles")
    cylinder.set_radius(0.035)
    cylinder.set_length(0.3)
    cylinder.set_translation(osim.Vec3(0.0, -0.41, 0))
    cylinder.set_quadrant("+x")
    bodies[1].addWrapObject(cylinder)
    paths = {
        "straight": [(0, (-0.05, 0.05, 0.02)), (2, (-0.03, -0.06, 0.01))],
        "wrapping": [(1, (0.04, -0.15, 0.0)), (2, (0.03, -0.08, 0.0))],
        "moving": [(1, (0.05, -0.2, 0.02)), None, (2, (0.05, -0.1, 0.01))],
        "conditional": [(1, (-0.03, -0.3, -0.02)), "when", (3, (-0.06, -0.02, -0.01))],
    }
    for name, points in paths.items():
        muscle = osim.Thelen2003Muscle(name, 1500.0, 0.1, 0.2, 0.05)
        for number, point in enumerate(points):
            label = f"{name}-P{number}"
            if point is None:
                _moving_point(osim, muscle, label, bodies[2], model)
            elif point == "when":
                _conditional_point(osim, muscle, label, bodies[2], model)
            else:
                body, place = point
                muscle.addNewPathPoint(label, bodies[body], osim.Vec3(*place))
        if name == "wrapping":
            muscle.updGeometryPath().addPathWrap(cylinder)
        model.addForce(muscle)
    model.finalizeConnections()
    model.updForceSet().addGroup("thigh muscles")
    for name in MUSCLES[1:3]:
        model.updForceSet().addObjectToGroup("thigh muscles", name)
    for body in bodies:
        for number, place in enumerate(PLACES):
            model.addMarker(osim.Marker(f"{body.getName()}{number}", body, osim.Vec3(*place)))
    model.finalizeConnections()
    model.printToXML(str(path))


def _moving_point(osim: Any, muscle: Any, name: str, body: Any, model: Any) -> None:
    """A point of a kneecap's tendon, which slides along the shank as the knee bends."""
    point = osim.MovingPathPoint()
    point.setName(name)
    point.setParentFrame(body)
    for axis, values in (("x", (0.06, 0.05, 0.03)), ("y", (0.0, 0.03, -0.02)), ("z", (0.0, 0.0, 0.01))):
        spline = osim.SimmSpline()
        for at, value in zip((-2.5, -1.0, 1.0), values, strict=True):
            spline.addPoint(at, value)
        getattr(point, f"set_{axis}_location")(spline)
        getattr(point, f"connectSocket_{axis}_coordinate")(model.getCoordinateSet().get("knee"))
    muscle.updGeometryPath().updPathPointSet().adoptAndAppend(point)


def _conditional_point(osim: Any, muscle: Any, name: str, body: Any, model: Any) -> None:
    point = osim.ConditionalPathPoint()
    point.setName(name)
    point.setParentFrame(body)
    point.set_location(osim.Vec3(-0.04, -0.2, -0.01))
    point.set_range(0, -0.8)
    point.set_range(1, 0.2)
    point.connectSocket_coordinate(model.getCoordinateSet().get("ankle"))
    muscle.updGeometryPath().updPathPointSet().adoptAndAppend(point)


def reserves(osim: Any, path: Path) -> None:
    """Write a set of forces with a reserve actuator of the knee."""
    several = osim.ForceSet()
    reserve = osim.CoordinateActuator("knee")
    reserve.setName(RESERVE)
    several.cloneAndAppend(reserve)
    several.printToXML(str(path))


def motion(samples: int = 81, rate: float = 100.0) -> tuple[np.ndarray, np.ndarray]:
    """Time (S,), and the coordinates (S, 4) of a leg that swings, in m and rad."""
    time = np.arange(samples) / rate
    places = [0.05 * np.sin(4 * time), 0.5 * np.sin(5 * time)]
    return time, np.stack([*places, -0.9 + 0.6 * np.cos(6 * time), 0.3 * np.sin(7 * time)], axis=1)


def forces(time: np.ndarray, names: tuple[str, ...] = MUSCLES) -> np.ndarray:
    """Tensions (S, count) in N, of which none is zero."""
    at = np.arange(len(names))
    return np.asarray(200.0 + 40.0 * at + 90.0 * np.sin((3 + at) * time[:, None] + at))


def write_sto(path: Path, names: tuple[str, ...], time: np.ndarray, values: np.ndarray) -> None:
    """Write a storage file in radians."""
    rows = ["\t".join(f"{x:.17g}" for x in (t, *row)) for t, row in zip(time, values, strict=True)]
    head = [
        path.stem,
        "version=1",
        f"nRows={len(time)}",
        f"nColumns={1 + len(names)}",
        "inDegrees=no",
        "endheader",
    ]
    path.write_text("\n".join([*head, "\t".join(["time", *names]), *rows]) + "\n")
