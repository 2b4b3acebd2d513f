"""A parameter is the number of the file that it is named after: Pinocchio reads the file with it changed."""

from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from helpers.answers import random_states, relative_error
from linkwise import Options, generate, read_robot, read_system, write_package
from linkwise.package.load import import_package

pytest.importorskip("pinocchio")

import torch

from numeric.pinocchio_model import PinocchioModel

Numbers = Any
BOUND = 1e-10
ENTRIES = {f"{'xyz'[i]}{'xyz'[k]}": (i, k) for i in range(3) for k in range(i, 3)}


def turned(roll: float, pitch: float, yaw: float) -> Numbers:
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(a), np.sin(a)) for a in (roll, pitch, yaw))
    x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    return np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ y @ x


@dataclass(frozen=True)
class Body:
    """Mass, centre of mass, inertia about it along axes turned by rpy: an <inertial>."""

    mass: float
    com: Numbers
    inertia: Numbers
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def moved(self, place: Numbers, turn: Numbers) -> "Body":
        """Return the same body seen from a frame in which its own is at `place`, turned by `turn`."""
        full = turn @ turned(*self.rpy)
        return Body(self.mass, place + turn @ self.com, full @ self.inertia @ full.T)

    def joined(self, other: "Body") -> "Body":
        """Return the two as one, both in one frame's axes."""
        mass = self.mass + other.mass
        com = (self.mass * self.com + other.mass * other.com) / mass
        inertia = np.zeros((3, 3))
        for body in (self, other):
            d = body.com - com
            inertia = inertia + body.inertia + body.mass * (d @ d * np.eye(3) - np.outer(d, d))
        return Body(mass, com, inertia)

    def text(self) -> str:
        i = self.inertia
        moments = {
            "ixx": i[0, 0],
            "iyy": i[1, 1],
            "izz": i[2, 2],
            "ixy": i[0, 1],
            "ixz": i[0, 2],
            "iyz": i[1, 2],
        }
        entries = " ".join(f'{key}="{float(value)!r}"' for key, value in moments.items())
        origin = f'<origin xyz="{text(self.com)}" rpy="{text(self.rpy)}"/>'
        return f'<inertial>{origin}<mass value="{float(self.mass)!r}"/><inertia {entries}/></inertial>'


@dataclass(frozen=True)
class Hinge:
    """A <joint>."""

    parent: str
    child: str
    type: str
    xyz: Numbers
    rpy: tuple[float, float, float]
    axis: str = "0 0 1"
    inner: str = ""

    def text(self) -> str:
        return (
            f'<joint name="to_{self.child}" type="{self.type}"><parent link="{self.parent}"/>'
            f'<child link="{self.child}"/><origin xyz="{text(self.xyz)}" rpy="{text(self.rpy)}"/>'
            f'<axis xyz="{self.axis}"/>'
            f'<limit lower="-9" upper="9" effort="9" velocity="9"/>{self.inner}</joint>'
        )


def text(values: Numbers) -> str:
    return " ".join(repr(float(value)) for value in values)


def array(*values: float) -> Numbers:
    return np.array(values, dtype=float)


PRODUCTS = np.array([[0.05, 0.004, -0.006], [0.004, 0.06, 0.0], [-0.006, 0.0, 0.07]])
BODIES = {
    "base": None,
    "a": Body(1.5, array(0.1, 0.0, 0.05), PRODUCTS),
    "tool": Body(0.4, array(0.0, 0.1, 0.02), np.diag([0.01, 0.012, 0.015]), (0.3, 0.0, -0.2)),
    "b": Body(0.9, array(0.0, 0.2, 0.0), np.diag([0.02, 0.03, 0.04])),
    "bare": None,
    "c": Body(0.7, array(-0.1, 0.02, 0.3), PRODUCTS, (0.4, -0.5, 0.6)),
    "d": Body(0.6, array(0.02, 0.03, 0.1), np.diag([0.03, 0.02, 0.025]), (0.0, 0.7, 0.0)),
}
HINGES = {
    "a": Hinge("base", "a", "revolute", array(0.1, 0.2, 0.3), (0.2, 0.1, -0.3), "1 0 0"),
    "tool": Hinge("a", "tool", "fixed", array(0.1, -0.1, 0.2), (0.5, 0.4, 0.3)),
    "b": Hinge("tool", "b", "revolute", array(0.0, 0.25, 0.0), (0.0, 0.0, 0.0), "0 -1 0"),
    "bare": Hinge("b", "bare", "revolute", array(0.0, 0.0, 0.15), (1.5707963267948966, 0.0, 0.0), "0 1 0"),
    "c": Hinge("bare", "c", "prismatic", array(0.05, 0.0, 0.1), (0.0, -0.4, 0.0), "0.6 0 0.8"),
    "d": Hinge(
        "b",
        "d",
        "revolute",
        array(-0.1, 0.05, 0.0),
        (0.3, 0.0, 0.0),
        "0.48 0.6 0.64",
        '<mimic joint="to_b" multiplier="-1.5" offset="0.3"/>',
    ),
}
WHOLE = {link: body and body.moved(np.zeros(3), np.eye(3)) for link, body in BODIES.items() if link != "tool"}
"""Links that move as one, in the frame of the link that is kept."""
WHOLE["a"] = WHOLE["a"].joined(BODIES["tool"].moved(HINGES["tool"].xyz, turned(*HINGES["tool"].rpy)))  # type: ignore


def robot(bodies: dict[str, Body | None], hinges: dict[str, Hinge]) -> str:
    links = "".join(
        f'<link name="{name}">{body.text() if body else ""}</link>' for name, body in bodies.items()
    )
    return f'<robot name="bent">{links}{"".join(hinge.text() for hinge in hinges.values())}</robot>'


def changed(name: str, by: float) -> str:
    """Text of the file with the number behind a parameter changed."""
    kind, link, *component = name.split("_")
    if kind == "p":
        xyz = HINGES[link].xyz + by * np.eye(3)["xyz".index(component[0])]
        return robot(BODIES, HINGES | {link: replace(HINGES[link], xyz=xyz)})
    body = WHOLE[link]
    assert body is not None
    if kind == "m":
        body = replace(body, mass=body.mass + by)
    elif kind == "c":
        body = replace(body, com=body.com + by * np.eye(3)["xyz".index(component[0])])
    else:
        i, k = ENTRIES[component[0]]
        inertia = body.inertia.copy()
        inertia[i, k] += by
        inertia[k, i] = inertia[i, k]
        body = replace(body, inertia=inertia)
    alone = BODIES | {link: body} | ({"tool": None} if link == "a" else {})
    return robot(alone, HINGES)


STEP = {"m": 0.2, "c": 0.03, "I": 0.001, "p": 0.05}
NAMES = [
    f"{name}_{part}"
    for link, body in WHOLE.items()
    for name, parts in ((f"c_{link}", "xyz"), (f"I_{link}", ENTRIES), (f"p_{link}", "xyz"))
    for part in parts
    if (body or name == f"p_{link}") and name != "p_a" and link != "base"
] + [f"m_{link}" for link, body in WHOLE.items() if body]


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """The robot with its parameters symbolic."""
    folder = tmp_path_factory.mktemp("bent")
    (folder / "bent.urdf").write_text(robot(BODIES, HINGES))
    system = read_system(folder / "bent.urdf", Options("symbolic"))
    write_package(generate(system, ["numpy", "torch", "autograd"]), folder / "bent")
    return import_package(folder / "bent")


def test_every_component_is_a_parameter_in_the_frame_of_the_file(package: ModuleType) -> None:
    assert sorted(package.parameters) == sorted(NAMES)
    for name, value in package.parameters.items():
        kind, link, *component = name.split("_")
        body = WHOLE[link]
        if kind == "p":
            expected = HINGES[link].xyz["xyz".index(component[0])]
            assert value == expected, name
            continue
        assert body is not None
        if kind == "m":
            expected = body.mass
        elif kind == "c":
            expected = body.com["xyz".index(component[0])]
        else:
            expected = body.inertia[ENTRIES[component[0]]]
        assert value == expected if link == "b" else abs(value - expected) <= 1e-15, name


def test_a_changed_parameter_is_the_changed_number_of_the_file(package: ModuleType, tmp_path: Path) -> None:
    states = random_states(4, 3)
    motion = [torch.as_tensor(a) for a in states]
    before = package.load("numpy", kernel="straight").partial_torque(*states)
    without_effect = set()
    for name in NAMES:
        path = tmp_path / f"{name}.urdf"
        path.write_text(changed(name, STEP[name[0]]))
        oracle = PinocchioModel(path, read_system(path))
        value = {name: package.parameters[name] + STEP[name[0]]}
        expected = np.stack(
            [
                np.stack([oracle.torque(*state, link=link) for link in package.link_names], -1)
                for state in zip(*states, strict=True)
            ]
        )
        for kernel in ("rule", "straight"):
            given = package.load("numpy", value, kernel=kernel).partial_torque(*states)
            assert relative_error(given, expected) <= BOUND, name
        assert relative_error(package.load("autograd", value).partial_torque(*motion), expected) <= BOUND, (
            name
        )
        if relative_error(given, before) <= 1e-9:
            without_effect.add(name)
    # Link a turns about its own x axis alone; the place of a slide along itself only shifts its coordinate.
    assert without_effect <= {n for n in NAMES if n.startswith(("c_a_x", "I_a_"))} - {"I_a_xx"}


@pytest.mark.parametrize("name", ["m_c", "c_a_y", "I_d_xy", "I_b_xz", "p_b_y", "p_bare_x", "p_d_z"])
def test_gradients_by_parameters_are_slopes(name: str, package: ModuleType) -> None:
    motion = [torch.as_tensor(a) for a in random_states(4, 3)]
    own = package.parameters[name]

    def torque(value: Any, backend: str) -> Any:
        return package.load(backend, {name: value}).partial_torque(*motion)

    # Torques are polynomials of degree two in each parameter: central differences have no error of their own.
    slope = (torque(own + 0.01, "torch") - torque(own - 0.01, "torch")) / 0.02
    for backend in ("torch", "autograd"):
        value = torch.tensor(own, dtype=torch.float64)
        found = torch.autograd.functional.jacobian(lambda v, b=backend: torque(v, b), value)
        assert slope.abs().max() > 1e-3
        assert relative_error(found, slope) <= 1e-10


TOML = """schema = 1
[parameters]
l1 = {l1}
[[link]]
name = "upper"
mass = {mass}
com = ["l1/2", {y}, 0]
inertia = {{ xx = 0.01, yy = "l1**2/3", zz = 0.03, xy = {xy} }}
[[link]]
name = "tip"
mass = 0.5
com = [0, 0, 0.1]
inertia = {{ xx = 0.01, yy = 0.01, zz = 0.01 }}
[[joint]]
name = "shoulder"
parent = "base"
child = "upper"
axis = [0.6, 0.8, 0]
[[joint]]
name = "wrist"
type = "planar"
parent = "upper"
child = "tip"
xyz = ["l1", 0, {z}]
axis = [0, 1, 0]
"""
FILE = {"l1": 0.3, "mass": 1.2, "y": 0.0, "xy": 0.0, "z": 0.0}
MEANT = {"l1": "l1", "m_upper": "mass", "c_upper_y": "y", "I_upper_xy": "xy", "p_tip_z": "z"}
MJCF = """<mujoco><worldbody><body name="arm" pos="0 0 0.5">
<joint name="a" axis="0 1 0" pos="0.1 0.2 0.3"/><inertial pos="{com}" mass="1" diaginertia="0.1 0.2 0.15"/>
<body name="hand" pos="{pos}" euler="10 20 30"><joint name="b" axis="1 0 0" pos="0.05 0 -0.1"/>
<joint name="c" axis="0 0 1" pos="0 0.1 0"/>
<inertial pos="0.1 0 0.2" mass="{mass}" diaginertia="0.1 0.2 0.15" euler="30 0 0"/></body></body></worldbody>
</mujoco>"""
POSED = {"com": "0.3 0 0", "pos": "0.4 0 0.1", "mass": "2"}
MOVED = {
    "c_arm_x": {"com": "0.45 0 0"},
    "c_arm_z": {"com": "0.3 0 0.15"},
    "m_hand": {"mass": "2.15"},
    "p_hand_b_z": {"pos": "0.4 0 0.25"},
}


def assert_same(folder: Path, ending: str, before: str, after: str, name: str, value: float) -> None:
    """The package of the first text, with a parameter changed, has the torques of the second text's."""
    made = {}
    for stem, content, parameters in (("before", before, "symbolic"), ("after", after, "numeric")):
        (folder / f"{stem}.{ending}").write_text(content)
        system = read_system(folder / f"{stem}.{ending}", Options(parameters))  # type: ignore[arg-type]
        write_package(generate(system, ["numpy"], stem), folder / stem)
        made[stem] = import_package(folder / stem)
    n = len(made["after"].joint_names)
    states = random_states(n, 5)
    given = made["before"].load("numpy", {name: value}).partial_torque(*states)
    expected = made["after"].load("numpy").partial_torque(*states)
    assert relative_error(given, expected) <= BOUND
    assert relative_error(made["before"].load("numpy").partial_torque(*states), expected) > 1e-6


@pytest.mark.parametrize("name", MEANT)
def test_parameters_of_a_toml_file_mean_its_numbers(name: str, tmp_path: Path) -> None:
    value = FILE[MEANT[name]] + 0.003
    after = TOML.format(**(FILE | {MEANT[name]: value}))
    assert_same(tmp_path, "toml", TOML.format(**FILE), after, name, value)


@pytest.mark.parametrize("name", MOVED)
def test_parameters_of_an_mjcf_file_mean_its_numbers(name: str, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    (tmp_path / "robot.xml").write_text(MJCF.format(**POSED))
    own = {p.name: p.value for p in read_robot(tmp_path / "robot.xml", Options("symbolic")).parameters}
    after = MJCF.format(**(POSED | MOVED[name]))
    assert own["c_arm_x"] == 0.3
    assert_same(tmp_path, "xml", MJCF.format(**POSED), after, name, own[name] + 0.15)
