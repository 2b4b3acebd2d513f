"""Controllers near 90 degrees of a floating base's pitch: right or it is said, by back ends and C alike."""

import warnings
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import needs_compiler
from helpers.answers import relative_error
from helpers.impedance_in_c import ImpedanceInC
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package
from numpy.polynomial import chebyshev

pytestmark = needs_compiler
INERTIAL = '<inertial pos="0.02 0.01 {1}" mass="{0}" diaginertia="{2} {3} {4}"/>'
TRUNK, THIGH, SHANK = (
    INERTIAL.format(*numbers)
    for numbers in ((9, 0.1, 0.3, 0.2, 0.1), (3, -0.2, 0.05, 0.04, 0.01), (2, -0.15, 0.03, 0.025, 0.008))
)
LEG = f"""<mujoco model="leg"><compiler angle="radian"/><worldbody>
<body name="trunk"><freejoint name="base"/>{TRUNK}
<body name="thigh" pos="0 0.1 -0.2"><joint name="hip" axis="0 1 0"/>{THIGH}
<body name="shank" pos="0 0 -0.4"><joint name="knee" axis="0 1 0"/>{SHANK}
</body></body></body></worldbody></mujoco>"""
Q, QD = np.array([0.0, 0.0, 1.0, 0.3, 0.0, 0.2, 0.4, -0.5]), np.array([0.1, 0.2, -0.1, 0.5, 0.4, -0.3, 1, 2])
PUSHED = np.array([0.0, 0, 0, 0, 0, 0, 0.6, -0.7])
PITCH = 4
BACKENDS = ("numpy", "torch", "autograd", "native")
CONTROLLERS = ("cancel", "frame", "lighter", "uneven", "natural")
DISTANCES = (0.4, 0.1, 1e-2, 1e-3, 3e-5, 3e-6, 5e-7, 3e-8, 0.0)
SAID = {
    "float64": ("silent",) * 4 + ("vague",) * 3 + ("refused",) * 2,
    "float32": ("silent",) * 2 + ("vague",) + ("refused",) * 6,
}
"""Answers of all but the natural controller, by distance: half of the digits, and all, are lost there."""


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> tuple[ModuleType, ImpedanceInC]:
    folder = tmp_path_factory.mktemp("leg")
    (folder / "leg.xml").write_text(LEG, encoding="utf-8")
    write_package(generate(read_system(folder / "leg.xml"), kernel="loops"), folder / "leg")
    return import_package(folder / "leg"), ImpedanceInC(folder / "leg", folder / "leg.so")


def controller(package: ModuleType, robot: Any, kind: str) -> Any:
    natural = package.Natural
    if kind == "cancel":
        return robot.cancel({("hip", "shank", None, None)})
    if kind == "frame":
        frame = package.FrameImpedance("shank", damping=natural(plus=4.0), rows=("x", "y", "z"))
        return robot.partial_impedance(frame=frame)
    if kind == "natural":
        return robot.partial_impedance(damping=natural(plus=0.5))
    scale = {"shank": 0.5} if kind == "lighter" else {("hip", "shank"): 0.5}
    return robot.partial_impedance(natural(scale), natural(scale))


def in_c(model: Any, c: ImpedanceInC, kind: str, q: Any, qd: Any, external: Any) -> tuple[str, Any]:
    """Return what C says by what it returns, and the torques; one that is refused leaves them as they
    were."""
    weights, damping = np.ones((model.n, model.N, model.n)), np.eye(model.n) / 2.0
    hip, shank = model.joint_index("hip"), model.link_index("shank")
    if kind == "frame":
        given = {"rows": (3, 4, 5), "damping": 4.0 * np.eye(3)}
        status, tau = c.frame(q, qd, "shank", given, external=external, dtype=q.dtype)
        said = "silent" if not status else "vague" if status < -7 else "refused"
        assert said != "vague" or -7 - model.n <= status <= -8
    else:
        if kind == "natural":
            given = {"damping": damping}
        else:
            weights[(hip if kind != "lighter" else slice(None)), shank] = 0.0 if kind == "cancel" else 0.5
            given = {"keep_inertia": weights, "keep_velocity": weights, "regular": int(kind == "cancel")}
        status, tau = c.joints(q, qd, given, external=external, dtype=q.dtype)
        said = "silent" if not status else "vague" if status < 0 else "refused"
    if said != "silent" and kind != "cancel":  # of what need only be regular, rows change places
        number = status if status > 0 else -status - (7 if kind == "frame" else 0)
        assert model.joint_names[number - 1] in ("base_yaw", "base_roll")
    assert (tau == 7.0).all() == (said == "refused")
    return said, tau


def told(control: Any, *motion: Any) -> tuple[str, Any]:
    """Return the same in Python, whose messages name the joints."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            tau = np.asarray(control(*motion[:2], external=motion[2]))
        except ValueError as error:
            return ("refused" if "base_yaw, base_roll" in str(error) else str(error)), None
    if not caught:
        return "silent", tau
    (message,) = (str(warning.message) for warning in caught)  # it is said once
    return ("vague" if "joints base_yaw, base_roll can move together almost" in message else message), tau


def through_the_pole(control: Any) -> Any:
    """Torques, which are smooth in the pitch, at and beside the pole from those at a distance from it."""
    nodes = chebyshev.chebpts1(24)
    q = np.tile(Q, (len(nodes), 1))
    q[:, PITCH] = np.pi / 2 + 0.4 * nodes
    said, tau = told(control, q, np.tile(QD, (len(nodes), 1)), np.tile(PUSHED, (len(nodes), 1)))
    assert said == "silent"
    fitted = chebyshev.chebfit(nodes, tau, len(nodes) - 1)
    return lambda pitch: chebyshev.chebval((pitch - np.pi / 2) / 0.4, fitted)


@pytest.mark.parametrize("kind", ["float64", "float32"])
@pytest.mark.parametrize("what", CONTROLLERS)
def test_near_the_pole_all_say_the_same_and_are_right_or_say_so(
    what: str, kind: str, leg: tuple[ModuleType, ImpedanceInC]
) -> None:
    package, c = leg
    robots = {name: package.load(name) for name in BACKENDS}
    model = robots["numpy"]
    controls = {name: controller(package, robot, what) for name, robot in robots.items()}
    exact, half = through_the_pole(controls["numpy"]), 10.0 * float(np.finfo(kind).eps) ** 0.5
    for distance, expected in zip(DISTANCES, SAID[kind], strict=True):
        motion = [a.astype(kind) for a in (Q, QD, PUSHED)]
        motion[0][PITCH] = np.pi / 2 - distance
        answers = {"c": in_c(model, c, what, *motion)}
        for name, control in controls.items():
            given = motion
            if robots[name].backend.takes_tensors:
                given = list(map(pytest.importorskip("torch").from_numpy, motion))
            answers[name] = told(control, *given)
        said = {name: answer[0] for name, answer in answers.items()}
        wanted = "silent" if what == "natural" else expected
        assert said == dict.fromkeys(said, wanted), distance
        for name, (_, tau) in answers.items():
            if wanted == "silent" or (wanted == "vague" and what != "frame"):  # of which no more is known
                error = relative_error(tau, exact(float(motion[0][PITCH])))
                assert error <= (half if wanted == "silent" else 0.01), (name, distance)


def test_the_right_torque_of_a_hip_is_not_missed_in_silence(leg: tuple[ModuleType, ImpedanceInC]) -> None:
    package, c = leg
    model = package.load("numpy")
    q = Q.copy()
    for q[PITCH], said in ((1.5707963, "refused"), (1.57, "silent"), (1.0, "silent")):
        assert in_c(model, c, "cancel", q, QD, None)[0] == said


@pytest.mark.parametrize("kind", ["float64", "float32"])
def test_what_is_lighter_all_alike_is_as_well_known(kind: str, leg: tuple[ModuleType, ImpedanceInC]) -> None:
    """Links of a thousandth of their mass, which is rounding beside nothing that they are made from."""
    package, c = leg
    weights = np.full((8, 3, 8), 1e-3)
    given = {"keep_inertia": weights, "keep_velocity": weights}
    motion = [a.astype(kind) for a in (Q, QD, PUSHED)]
    motion[0][PITCH] = 0.4
    status, tau = c.joints(motion[0], motion[1], given, external=motion[2], dtype=motion[0].dtype)
    assert status == 0
    for name in BACKENDS:
        robot = package.load(name)
        light = robot.partial_impedance(package.Natural(1e-3), package.Natural(1e-3))
        given_motion: Any = motion
        if robot.backend.takes_tensors:
            given_motion = list(map(pytest.importorskip("torch").from_numpy, motion))
        said, found = told(light, *given_motion)
        assert said == "silent"
        assert relative_error(found, tau) <= 1e4 * np.finfo(kind).eps
