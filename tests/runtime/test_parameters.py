"""Run-time parameters: their names, what `inspect` says of them, and which values `load` refuses."""

import copy
import json
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from helpers.answers import random_states
from helpers.urdf_text import chain, joint, link, robot
from linkwise import LinkwiseError, Options, generate, read_robot, read_system, write_package
from linkwise.cli.inspect import inspection, table
from linkwise.package.load import import_package
from linkwise.robot import mass
from linkwise.robot.description import Body
from linkwise_runtime import parameter_values
from linkwise_runtime.parameter_values import REASONS, faults

torch = pytest.importorskip("torch")

TOML = """schema = 1
name = "arm"
[parameters]
l1 = 0.3
m_fore = 0.7
idle = 4
[[link]]
name = "upper"
mass = 1.2
com = ["l1/2", 0, 0]
inertia = { xx = 0.01, yy = "1.2*l1**2/12", zz = 0.01 }
[[link]]
name = "fore"
mass = 1
com = [0, 0, "m_fore/7"]
inertia = { xx = 0.02, yy = 0.02, zz = 0.01 }
[[link]]
name = "bare"
[[joint]]
name = "shoulder"
parent = "base"
child = "upper"
xyz = [0, 0, 0.1]
axis = [1, 0, 0]
[[joint]]
name = "turn"
parent = "upper"
child = "bare"
xyz = ["l1", 0, 0]
axis = [0, 1, 0]
[[joint]]
name = "elbow"
parent = "bare"
child = "fore"
xyz = [0, 0.1, 0]
axis = [0.6, 0, 0.8]
"""
BACKENDS = ["numpy", "torch", "autograd"]


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """The arm of TOML with its parameters symbolic."""
    return package(tmp_path_factory.mktemp("arm"), TOML)


def package(folder: Path, text: str, **options: Any) -> ModuleType:
    ending = "toml" if text.startswith("schema") else "urdf"
    (folder / f"robot.{ending}").write_text(text)
    system = read_system(folder / f"robot.{ending}", Options("symbolic", **options))
    write_package(generate(system, BACKENDS, "made"), folder / "made")
    return import_package(folder / "made")


def listed(spec: Any, **options: Any) -> dict[str, dict[str, Any]]:
    data = json.loads(
        json.dumps(inspection(read_system(spec, Options(**({"parameters": "symbolic"} | options)))))
    )
    return {entry["name"]: entry for entry in data["parameters"]}


def test_formulas_stay_and_every_other_number_is_a_parameter(tmp_path: Path, arm: ModuleType) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(TOML)
    found = listed(path)
    assert {name: entry["value"] for name, entry in found.items()} == dict(arm.parameters)
    upper = ["m_upper", "c_upper_y", "c_upper_z", *(f"I_upper_{k}" for k in ("xx", "zz", "xy", "xz", "yz"))]
    fore = ["p_fore_x", "p_fore_y", "p_fore_z", "m_fore_", "c_fore_x", "c_fore_y"]
    assert list(found) == [
        "l1",
        "m_fore",
        *upper,
        "p_bare_y",
        "p_bare_z",
        *fore,
        *(f"I_fore_{k}" for k in ("xx", "yy", "zz", "xy", "xz", "yz")),
    ]
    assert found["c_upper_y"] == {
        "name": "c_upper_y",
        "value": 0.0,
        "unit": "m",
        "meaning": "centre of mass of link 'upper': y in the link's frame",
    }
    assert found["p_fore_z"]["meaning"] == "place of joint 'elbow': z in the frame of link 'bare'"
    assert found["I_upper_xz"]["unit"] == "kg m^2"
    assert found["l1"]["meaning"] == "of the file's own, for p_bare_x, c_upper_x, I_upper_yy"
    text = table(inspection(read_system(path, Options("symbolic"))))
    assert "  m_upper = 1.2 kg          mass of link 'upper'\n" in text
    assert not listed(path, parameters="numeric")
    assert not [entry for entry in listed(path, parameters="nonzero").values() if entry["value"] == 0.0]


def test_what_is_merged_locked_or_on_the_ground_is_said(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(chain(joint("ab", "a", "b"), joint("bc", "b", "c", type="fixed"), joint("cd", "c", "d")))
    found = listed(path)
    assert not [name for name in found if name.startswith(("m_a", "m_c", "p_b", "p_c"))]
    assert found["m_b"]["value"] == 3.0
    assert found["m_b"]["meaning"] == "mass of link 'b' with what is fixed to it"
    assert found["p_d_x"] == {
        "name": "p_d_x",
        "value": 0.2,
        "unit": "m",
        "meaning": "place of joint 'cd': x in the frame of link 'c'",
    }
    assert not [name for name in listed(path, lock={"cd": 0.5}) if "_d" in name]
    floating = listed(path, base="floating")
    assert {"m_a", "p_b_x"} <= set(floating)
    assert not [name for name in floating if name.startswith("p_a")]


@pytest.mark.parametrize("kind", ["planar", "ball", "floating"])
def test_a_joint_of_many_axes_has_one_place(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(chain(joint("ab", "a", "b"), joint("bc", "b", "c", type=kind, axis="0 1 0")))
    places = {name: entry["value"] for name, entry in listed(path).items() if name.startswith("p_")}
    assert places == {"p_c_x": 0.2, "p_c_y": 0.1, "p_c_z": 0.3}


def test_values_in_turned_frames_are_the_files_to_the_last_digit(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    for axis in ("1 0 0", "0 -1 0", "0.6 0 0.8", "0.3 0.4 0.5"):
        path.write_text(
            robot(link("a"), link("b"), joint("ab", "a", "b", axis=axis)).replace(' rpy="0.1 0.2 0.3"', "")
        )
        values = {p.name: p.value for p in read_robot(path, Options("symbolic")).parameters}
        assert [values[f"c_b_{k}"] for k in "xyz"] == [0.1, -0.02, 0.05]
        entries = [values[f"I_b_{k}"] for k in ("xx", "yy", "zz", "xy", "xz", "yz")]
        assert entries == [0.03, 0.04, 0.05, 0.001, -0.002, 0.003]


REFUSED = {
    "mass": (
        {"m_upper": -1},
        r"link 'upper' would have a negative mass, with m_upper = -1; no body has that",
    ),
    "tensor": ({"m_upper": torch.tensor(-1.0, requires_grad=True)}, "a negative mass, with m_upper = -1"),
    "moment": (
        {"I_fore_xx": -0.1},
        "link 'fore' would have an inertia that is not positive.*I_fore_xx = -0.1",
    ),
    "product": (
        {"I_fore_xy": 0.05},
        "link 'fore' would have an inertia that is not positive.*I_fore_xy = 0.05",
    ),
    "triangle": (
        {"I_fore_xx": 0.05, "I_fore_yy": 0.019},
        "triangle inequality.*I_fore_xx = 0.05, I_fore_yy = 0.019",
    ),
    "formula": (
        {"l1": 0.9},
        "link 'upper' would have .* triangle inequality.*with l1 = 0.9; .*--allow-unphysical",
    ),
    "one sample": (
        {"m_upper": np.array([1.0, -1.0])},
        "link 'upper' would have a negative mass, with m_upper;",
    ),
    "tensor of samples": ({"m_upper": torch.tensor([1.0, -1.0])}, "link 'upper' would have a negative mass"),
    "nan": ({"c_fore_x": float("nan")}, "parameter 'c_fore_x' is NaN or infinite; give a finite number"),
    "nan tensor": ({"c_fore_x": torch.tensor(torch.inf)}, "parameter 'c_fore_x' is NaN or infinite"),
    "near": (
        {"m_uper": 1.0},
        "no parameter 'm_uper' in any number; near it are m_upper, .*and `parameters` has all 24",
    ),
    "far": (
        {"zzz": 1.0},
        "no parameter 'zzz' in any number; near it are I_fore_zz, I_upper_zz, .*and `parameters` has all 24",
    ),
    "shapes": (
        {"m_upper": np.ones(3), "I_upper_xx": np.full(2, 0.01)},
        "parameters m_upper, I_upper_xx differ in shape; give each one number a sample",
    ),
}
NO_NUMBER = {
    "text": "1.2",
    "nothing": None,
    "list of lists": [1.0, [2.0, 3.0]],
    "complex": 1j,
    "complex tensor": torch.tensor(1j),
    "truth": True,
    "400 digits": 10**400,
    "mapping": {"m": 1.0},
}


@pytest.mark.parametrize("case", REFUSED)
@pytest.mark.parametrize("backend", ["torch", "autograd"])
def test_values_that_no_body_has_are_refused_by_name(backend: str, case: str, arm: ModuleType) -> None:
    given, message = REFUSED[case]
    with pytest.raises(ValueError, match=message):
        arm.load(backend, given)


def test_values_that_no_body_has_are_taken_where_that_is_asked_for(arm: ModuleType) -> None:
    robot = arm.load("numpy", {"m_upper": -1.0}, allow_unphysical=True)
    assert copy.deepcopy(robot).parameters["m_upper"] == -1.0


@pytest.mark.parametrize("case", NO_NUMBER)
def test_what_is_not_a_number_is_refused_by_name(case: str, arm: ModuleType) -> None:
    with pytest.raises(
        TypeError, match=r"^parameter 'm_upper' is .{1,70}; give a number, or an array of one"
    ):
        arm.load("numpy", {"m_upper": NO_NUMBER[case]})


@pytest.mark.parametrize(
    "value", [2, 2.0, np.float32(2.0), np.array(2), [2.0], torch.tensor(2), torch.tensor([2.0])]
)
@pytest.mark.parametrize("backend", BACKENDS)
def test_numbers_of_every_kind_are_taken(backend: str, value: Any, arm: ModuleType) -> None:
    states = random_states(3, 3)
    motion = states if backend == "numpy" else [torch.as_tensor(a) for a in states]
    given, expected = (arm.load(backend, {"m_upper": m}).partial_torque(*motion) for m in (value, 2.0))
    assert np.array_equal(np.asarray(given), np.asarray(expected))


@pytest.mark.parametrize("backend", BACKENDS)
def test_one_value_a_sample_must_fit_the_motion(backend: str, arm: ModuleType) -> None:
    states = random_states(3, 4)
    motion = states if backend == "numpy" else [torch.as_tensor(a) for a in states]
    with pytest.raises(
        ValueError, match=r"'m_upper' has shape \(3,\), the motion has samples of shape \(4,\)"
    ):
        arm.load(backend, {"m_upper": np.ones(3)}).partial_torque(*motion)
    of_two_axes = [np.stack([m, m]) if backend == "numpy" else torch.stack([m, m]) for m in motion]
    with pytest.raises(ValueError, match=r"has shape \(2, 3\), the motion has samples of shape \(2, 4\)"):
        arm.load(backend, {"m_upper": np.ones((2, 3))}).partial_torque(*of_two_axes)
    each = arm.load(backend, {"m_upper": np.arange(4.0)}).partial_torque(*motion)
    alone = arm.load(backend, {"m_upper": 2.0}).partial_torque(*motion)
    assert np.array_equal(np.asarray(each)[2], np.asarray(alone)[2])


def test_parameters_come_by_name(arm: ModuleType) -> None:
    with pytest.raises(TypeError, match=r"^parameters is list; give values by name, such as \{'l1': 0.3\}"):
        arm.load("numpy", [1.0])


def test_a_gradient_is_not_lost_on_arrays(arm: ModuleType) -> None:
    with pytest.raises(TypeError, match="'m_upper' requires a gradient, which arrays do not carry"):
        arm.load("numpy", {"m_upper": torch.tensor(2.0, requires_grad=True)})


def test_values_inside_a_transformation_are_not_looked_at(arm: ModuleType) -> None:
    motion = [torch.as_tensor(a) for a in random_states(3, 3)]

    def torque(m: Any) -> Any:
        return arm.load("torch", {"m_upper": m}).inverse_dynamics(*motion)

    masses = torch.tensor([1.0, -2.0], dtype=torch.float64)
    assert torch.func.vmap(torque)(masses).shape == (2, 3, 3)
    assert torch.func.jacrev(torque)(masses[0]).shape == (3, 3)


def test_all_values_are_taken_where_the_package_says_so(tmp_path: Path, arm: ModuleType) -> None:
    free = package(tmp_path, TOML, allow_unphysical=True)
    states = random_states(3, 3)
    assert np.isfinite(free.load("numpy", {"m_upper": -1.0}).partial_torque(*states)).all()
    assert "also such as no body has: generated with --allow-unphysical" in free.load.__doc__
    assert "Values that no rigid body has are refused" in arm.load.__doc__
    with pytest.raises(ValueError, match="parameter 'm_upper' is NaN"):
        free.load("numpy", {"m_upper": float("nan")})


def test_a_link_that_the_file_allows_is_not_held_to_it(tmp_path: Path) -> None:
    """puma560 says of link3 that its published inertia breaks the triangle inequality."""
    files = generate(read_system("puma560", Options("symbolic")), ["numpy"])
    write_package(files, tmp_path / "puma560")
    puma = import_package(tmp_path / "puma560")
    assert puma.load("numpy", {"m_link3": 5.0}).n == 6
    assert "as they break it in the file already: 'link3'." in puma.load.__doc__
    with pytest.raises(ValueError, match="link 'link2' would have a negative mass"):
        puma.load("numpy", {"m_link2": -5.0})


def test_parameters_of_energies_are_free(package_of: Callable[[str], ModuleType], tmp_path: Path) -> None:
    cart = Path(__file__).parents[1] / "data" / "cart_pendulum.py"
    write_package(generate(read_system(cart, Options("symbolic")), ["numpy"]), tmp_path / "cart")
    made = import_package(tmp_path / "cart")
    assert made.load("numpy", {"k": -1.0}).parameters["k"] == -1.0
    assert "They are those of the energies: any finite value is taken." in made.load.__doc__
    assert {entry["meaning"] for entry in listed(cart).values()} == {"of the energies"}


def test_a_package_judges_bodies_as_reading_does() -> None:
    """The runtime has the generator's rule once more, as a package imports nothing of it."""
    assert (parameter_values.TRIANGLE, parameter_values.SPECK) == (mass.TRIANGLE, mass.SPECK)
    draw = np.random.default_rng(5)
    verdicts = []
    anything = draw.uniform(-0.15, 1.0, (300, 7)) * [1, 1, 1, 1, 0.2, 0.2, 0.2]
    rods = [np.array([1.0, 0.0, 1e-3, high, 0.0, 0.0, 0.0]) for high in (1e-3, 1.1e-3)]
    for values in (*anything, *rods):
        m, xx, yy, zz, xy, xz, yz = values
        body = Body("a", m, (0.0, 0.0, 0.0), ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
        try:
            mass.check_bodies([body], False)
            fault = ""
        except LinkwiseError as error:
            fault = str(error)
        verdict = parameter_values.faults(values)
        words = ("", "NaN", "negative mass", "not positive", "triangle")[int(verdict)]
        assert bool(words) == bool(fault)
        assert words in fault
        verdicts.append(words)
    assert set(verdicts) == {"", "negative mass", "not positive", "triangle"}


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ((1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0), ""),
        ((np.nan, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0), "a mass or an inertia that is NaN or infinite"),
        ((1.0, 1.0, 1.0, np.inf, 0.0, 0.0, 0.0), "a mass or an inertia that is NaN or infinite"),
        ((-1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0), "a negative mass"),
        (
            (1.0, 1.0, 1.0, 1.0, 2.0, 0.0, 0.0),
            "an inertia that is not positive: a principal moment is negative",
        ),
        ((1.0, 1.0, 1.0, 3.0, 0.0, 0.0, 0.0), "an inertia that breaks the triangle inequality"),
    ],
)
def test_what_no_body_has_is_told_by_its_reason(values: tuple[float, ...], reason: str) -> None:
    found = REASONS[int(faults(np.array(values)))]
    assert found == reason or (reason and found.startswith(reason))
