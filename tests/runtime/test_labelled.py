"""Answers with names along their axes: the calls' numbers, where the names say, in the units told."""

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.call_table import CALLS
from linkwise_runtime.certainty.uncertain_bodies import UncertainBodies
from linkwise_runtime.robot_axes import inertial, written

xr = pytest.importorskip("xarray")

ROBOT = """
schema = 1
name = "{name}"
gravity = [0, {gravity}, 0]
parameters = {{I = {inertia}}}
joint = [
  {{name = "crank", parent = "base", child = "crank", stiffness = {torque}, damping = {torque_s}}},
  {{name = "knee", parent = "crank", child = "rod", xyz = [{length}, 0, 0], armature = {inertia}}},
  {{name = "/lift", type = "prismatic", parent = "rod", child = "tip", axis = [1, 1, 0], friction = {force}}},
  {{name = "ram", type = "prismatic", parent = "base", child = "slider", axis = [1, 0, 0], damping = {drag}}},
]
link = [
  {{name = "base"}},
  {{name = "crank", mass = {mass}, com = [{length}, 0, 0], inertia = {{xx = "I", yy = "I", zz = "I"}}}},
  {{name = "rod", mass = {mass}, com = [0, {length}, 0], inertia = {{xx = "I", yy = "I", zz = "I"}}}},
  {{name = "tip", mass = {mass}, com = [{length}, 0, 0]}},
  {{name = "slider", mass = {mass}}},
]
constraint = [
  {{name = "pin", type = "hinge", first = {{frame = "rod", xyz = [{arm}, 0, 0]}}, second = "slider"}},
  {{name = "gear", type = "coupling", terms = {{knee = 1.0, "/lift" = [0.0, {per_length}]}}}},
]
independent = ["crank"]
"""
SCALES = {"kg": 2.0, "m": 4.0, "s": 0.5, "rad": 1.0}
"""Factor by which a unit of the second robot is smaller."""
SCALES |= {"N": SCALES["kg"] * SCALES["m"] / SCALES["s"] ** 2}
SCALES |= {"J": SCALES["N"] * SCALES["m"], "W": SCALES["N"] * SCALES["m"] / SCALES["s"]}
Q, QD, QDD = np.random.default_rng(5).uniform(-0.3, 0.3, (3, 3, 4))
Q += [1.0, -1.2, 0.3, 1.2]
FORCE = np.array([3.0, -2.0, 0.5])


def scale(unit: str) -> float:
    """Return the factor of a number in this unit where units are smaller: read from the text alone."""
    above, _, below = unit.partition("/")
    factor = 1.0
    for part, sign in ((above, 1), (below.strip("()"), -1)):
        for word in part.split():
            symbol, _, power = word.partition("^")
            factor *= 1.0 if symbol == "1" else SCALES[symbol] ** (sign * int(power or 1))
    return factor


def robot_in(folder: Path, scales: dict[str, float]) -> Any:
    name = f"press{int(scales['m'])}"
    units = {
        "length": "m",
        "arm": "m",
        "mass": "kg",
        "inertia": "kg m^2",
        "gravity": "m/s^2",
        "torque": "N m",
    }
    units |= {"torque_s": "N m s/rad", "force": "N", "drag": "N s/m", "per_length": "1/m"}
    values = dict.fromkeys(units, 0.3) | {"arm": 1.1, "mass": 1.5, "gravity": -9.0, "inertia": 0.2}
    numbers = {key: values[key] * (scale(unit) if scales is SCALES else 1.0) for key, unit in units.items()}
    file = folder / f"{name}.toml"
    file.write_text(ROBOT.format(name=name, **numbers), encoding="utf-8")
    write_package(generate(read_system(file), ["numpy", "torch"]), folder / name)
    return import_package(folder / name)


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Any]:
    """A press in two systems of units."""
    folder = tmp_path_factory.mktemp("press")
    return robot_in(folder, dict.fromkeys(SCALES, 1.0)), robot_in(folder, SCALES)


def calls(package: Any, robot: Any, times: Any) -> Iterator[tuple[str, tuple[Any, ...], dict[str, Any]]]:
    """Every call with arguments; times(array, unit): the same in the robot's units."""
    along = [times(1.0, unit) for unit in robot.joint_units]
    closed = robot.constraints.closed(Q * along)
    q, qd, qdd = closed, QD * along / times(1.0, "s"), QDD * along / times(1.0, "s^2")
    tau = np.array([2.0, 1.0, -1.0, 0.5]) * times(1.0, "N m") / [1, 1, times(1.0, "m"), times(1.0, "m")]
    force, own = times(FORCE, "N"), {"frame": "rod", "point": times(FORCE, "m")}
    loads = [package.AppliedLoad("rod", force), package.AppliedLoad("tip", force)]
    for name in (
        "partial_torque",
        "inverse_dynamics",
        "passive_torque",
        "position_gradient",
        "regressor",
        "power",
    ):
        yield name, (q, qd, qdd), {}
    for name in ("coefficients", "coefficient_regressors", "energy", "coriolis_matrix", "named_shares"):
        yield name, (q, qd), {}
    for by_link in (False, True):
        yield "mass_matrix", (q,), {"by_link": by_link}
        yield "coriolis_matrix", (q, qd), {"by_link": by_link}
        yield "gravity_torque", (q,), {"by_link": by_link}
        yield "christoffel", (q,), {"by_link": by_link}
        yield "constraints.projected", (q, np.stack([tau, tau], -1) if by_link else tau), {"by_link": by_link}
        yield "constraints.forces_of", (q, np.stack([tau, tau], -1) if by_link else tau), {"by_link": by_link}
    for convention in ("closing", "gradient"):
        yield "propagation", (q, qd, qdd), {"convention": convention}
    yield "masked", (q, qd, qdd, np.ones((3, 4))), {}
    deviations = UncertainBodies(0.1, times(0.01, "m"), 0.2, 0.03)
    yield "uncertainty", (q, qd, qdd, deviations), {}
    yield "natural_impedance", (q, qd, qdd), {}
    for frame in ({}, own, {"frame": "centre of mass"}):
        yield "induced_accelerations", (q, qd, tau), {"loads": loads, "passive": True, **frame}
    for name in ("induced_reactions", "induced_power", "induced_flow"):
        yield name, (q, qd, tau), {"loads": loads, "passive": True}
    yield "reactions", (q, qd, qdd), {"loads": loads, "axes": "world"}
    yield "reactions", (q, qd, qdd), {"loads": loads, "joints": [1, "ram"], "constraints": False}
    yield "simulate", (q, qd, times(np.linspace(0, 0.02, 3), "s"), tau), {}
    instants = times(np.linspace(0, 0.02, len(Q)), "s")
    yield "trace", (q, qd, qdd, instants, tau), {"loads": loads}
    yield "counterfactual", (q, qd, qdd, instants, "gravity", tau), {"loads": loads}
    for name, motion in (
        ("pose", (q,)),
        ("jacobian", (q,)),
        ("jacobian_rate", (q, qd)),
        ("velocity", (q, qd)),
    ):
        yield f"kinematics.{name}", motion, {"frame": "tip"}
    yield "kinematics.acceleration", (q, qd, qdd), own
    yield "kinematics.load_torque", (q, "rod", force), {"moment": times(FORCE, "N m")}
    for name in ("poses", "centre_of_mass", "centre_of_mass_jacobian"):
        yield f"kinematics.{name}", (q,), {}
    yield "kinematics.centre_of_mass_jacobian_rate", (q, qd), {}
    for name in ("violation", "jacobian", "closed", "velocity_map"):
        yield f"constraints.{name}", (q + times(0.0, "1"),), {}
    yield "constraints.jacobian_rate", (q, qd), {}
    yield "constraints.velocity", (q, qd[:, :1]), {}
    yield "constraints.acceleration", (q, qd, qdd[:, :1]), {}
    yield "constraints.velocity_accelerations", (q, qd), {}
    for name in ("inverse_dynamics", "partial_torque", "propagation", "forces"):
        yield f"constraints.{name}", (q, qd, qdd), {}
    yield "constraints.coefficients", (q, qd), {}
    yield "constraints.force_coefficients", (q, qd), {}
    yield "constraints.force_propagation", (q, qd, qdd), {}
    yield "constraints.forward_dynamics", (q, qd, tau), {"passive": True}


def units_of(one: Any) -> Any:
    """The unit of each entry, as the attribute or the coordinate says."""
    named = one.attrs.get("units_from")
    return one.coords[named] if named else xr.DataArray(one.attrs.get("units", ""))


def same(smaller: Any, larger: Any) -> bool:
    """Return whether numbers in smaller units are as many times larger as their units say; unknown ones
    any."""
    units = units_of(larger)
    assert units.equals(units_of(smaller))
    factor = xr.DataArray([scale(u) if u else np.nan for u in units.values.ravel()], dims="at").values
    expected = (larger * units.copy(data=factor.reshape(units.shape))).transpose(*larger.dims)
    known = np.isfinite(expected.values)
    difference = np.where(known, smaller.values - expected.values, 0.0)
    return bool(np.abs(difference).max() <= 1e-9 * np.abs(expected.values[known]).max(initial=1e-300))


def test_units_are_those_in_which_every_number_of_every_call_is(packages: tuple[Any, Any]) -> None:
    robots = [package.load("numpy") for package in packages]
    plain = calls(packages[0], robots[0], lambda value, unit: value)
    smaller = calls(packages[1], robots[1], lambda value, unit: value * scale(unit))
    seen = set()
    for (name, given, named), (_, others, named_so) in zip(plain, smaller, strict=True):
        one, other = robots[0].labelled(name, *given, **named), robots[1].labelled(name, *others, **named_so)
        told = (
            [(one, other)] if isinstance(one, xr.DataArray) else [(one[v], other[v]) for v in one.data_vars]
        )
        for larger, small in told:
            assert same(small, larger), (name, larger.name)
        seen.add(name)
    assert {row.name for row in CALLS.values() if row.is_named} - seen == {"forward_dynamics"}


@pytest.mark.parametrize(
    ("unit", "text"),
    [
        ({"N": 1, "m": 1, "rad": -1}, "N m/rad"),
        ({"m": -1, "s": -2}, "1/(m s^2)"),
        ({}, "1"),
        ({"?": 1, "s": 1}, ""),
    ],
)
def test_units_are_written_as_physicists_do(unit: dict[str, int], text: str) -> None:
    assert written(unit) == text


def test_newtons_are_told_in_kilograms_where_inertia_is() -> None:
    assert written(inertial({"N": 1, "m": 1, "s": 2, "rad": -1})) == "kg m^2"


def test_an_entry_is_found_by_the_names_of_joint_link_cause_and_order(packages: tuple[Any, Any]) -> None:
    robot = packages[0].load("numpy")
    time = np.array([0.0, 0.1, 0.2])
    answer = robot.labelled("propagation", Q, QD, QDD, along={"time": time})
    plain = robot.propagation(Q, QD, QDD)
    by_name = answer.propagation.sel(joint="crank", link="tip", cause="/lift")
    np.testing.assert_array_equal(by_name.sel(order="velocity"), plain.velocity[:, 0, 2, 2])
    np.testing.assert_array_equal(by_name.sel(order="acceleration"), plain.acceleration[:, 0, 2, 2])
    np.testing.assert_array_equal(answer.gravity.sel(joint="knee", link="tip"), plain.gravity[:, 1, 2])
    assert by_name.coords[answer.propagation.units_from] == "N m"
    assert answer.propagation.sel(joint="ram").coords[answer.propagation.units_from] == "N"
    assert answer.attrs["convention"] == "closing"
    assert answer.time.attrs == {"units": "s"}
    summed = answer.propagation.sum(["cause", "order"]) + answer.gravity
    np.testing.assert_allclose(summed, robot.labelled("partial_torque", Q, QD, QDD), atol=1e-12)


def test_arguments_with_names_may_have_them_in_any_order(packages: tuple[Any, Any]) -> None:
    robot = packages[0].load("torch")
    q = xr.DataArray(
        Q, dims=("trial", "joint"), coords={"trial": ["a", "b", "c"], "joint": [*robot.joint_names]}
    )
    qd, qdd = (q.copy(data=values) for values in (QD, QDD))
    turned = q.transpose("joint", "trial").isel(joint=[2, 0, 3, 1])
    answer = robot.labelled("partial_torque", turned, qd, qdd)
    assert answer.dims == ("trial", "joint", "link")
    np.testing.assert_array_equal(answer.sel(trial="b"), robot.partial_torque(Q, QD, QDD)[1])
    closed = robot.labelled("constraints.closed", turned)
    followed = robot.labelled("constraints.velocity", closed, qd.sel(joint=["crank"]))
    np.testing.assert_array_equal(followed, robot.constraints.velocity(closed.values, QD[:, :1]))
    renamed = q.assign_coords(joint=["crank", "knees", "/lift", "ram"])
    with pytest.raises(ValueError, match="q has no joint 'knee'; it has knees, "):
        robot.labelled("partial_torque", renamed, qd, qdd)
    with pytest.raises(ValueError, match="q, qd, qdd are of different samples: "):
        robot.labelled("partial_torque", q[:2], qd, qdd)


def test_joints_are_named_once_and_independent_ones_may_stand_alone(packages: tuple[Any, Any]) -> None:
    robot = packages[0].load("numpy")
    q = xr.DataArray(Q[0], dims="joint", coords={"joint": [*robot.joint_names]})
    twice = q.isel(joint=[0, 1, 2, 3, 1])
    with pytest.raises(ValueError, match=r"^q has the joint 'knee' 2 times$"):
        robot.labelled("mass_matrix", twice)
    own = q.sel(joint=["crank"])
    closed = robot.labelled("constraints.closed", own)
    np.testing.assert_array_equal(closed, robot.constraints.closed(own.values))
    assert robot.labelled("mass_matrix", Q, by_link=2).dims == ("sample", "joint", "link", "cause")
    moved = robot.labelled("simulate", own, own, [0.0, 0.01])
    np.testing.assert_array_equal(moved.q, robot.simulate(own.values, own.values, [0.0, 0.01]).q)
    with pytest.raises(ValueError, match="'time' is an axis of the samples twice"):
        robot.labelled("simulate", Q, QD, [0.0, 0.01], along="time")


def test_what_has_no_names_is_refused_in_one_line(packages: tuple[Any, Any]) -> None:
    robot = packages[0].load("numpy")
    for told, mend in {
        "partial_torqe": "partial_torque",
        "packed": "masked",
        "graph": "gravity_torque",
    }.items():
        with pytest.raises(
            ValueError, match=rf"^'{told}' answers with no array whose axes have names.* {mend}"
        ):
            robot.labelled(told, Q, QD, QDD)
    with pytest.raises(ValueError, match=r"along has 2 names, \['trial', 'time'\]; the samples have 1 axes"):
        robot.labelled("mass_matrix", Q, along=("trial", "time"))
    with pytest.raises(ValueError, match="the samples' axis 'joint' is one of the answer too"):
        robot.labelled("mass_matrix", Q, along="joint")
    for wrong in (5, [5], {5: [0.0, 0.1, 0.2]}):
        with pytest.raises(TypeError, match=r"^along is .*5.*; give names of the samples' axes$"):
            robot.labelled("mass_matrix", Q, along=wrong)
    with pytest.raises(ValueError, match=r"^along 'time' stands what has shape \(2,\); there are 3 samples$"):
        robot.labelled("mass_matrix", Q, along={"time": [0.0, 0.1]})
    one = xr.DataArray(Q[0], dims="joint")
    with pytest.raises(
        ValueError, match=r"with names are of \(\) samples, with the others there are \(7,\); give"
    ):
        robot.labelled("kinematics.velocity", one, one, "tip", point=np.zeros((7, 3)))
    with pytest.raises(TypeError, match="leave out away"):
        robot.labelled("mass_matrix", Q, out=np.zeros((3, 4, 4)))


def test_a_package_needs_xarray_only_for_names(
    packages: tuple[Any, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    robot = packages[0].load("numpy")
    robot.mass_matrix(Q)
    with pytest.raises(ImportError, match=r"^names along axes are xarray's, .*: pip install xarray"):
        robot.labelled("mass_matrix", Q)


@pytest.mark.parametrize("joint", ["knee", "/jointset/walker/knee", "/jointset/walker/knee/value"])
def test_paths_of_opensim_are_their_coordinate(packages: tuple[Any, Any], joint: str) -> None:
    robot = packages[0].load("numpy")
    assert robot.joint_index(joint) == 1
    assert robot.joint_index("/lift") == 2
    assert robot.link_index("/bodyset/rod") == 1
    np.testing.assert_array_equal(robot.kinematics.pose(Q, "/bodyset/tip"), robot.kinematics.pose(Q, "tip"))


def test_a_notebook_shows_joints_and_links(packages: tuple[Any, Any]) -> None:
    page = packages[0].load("numpy")._repr_html_()
    cells = re.findall(r"<td[^>]*>([^<]*)</td>", page)
    assert cells[:12] == ["0", "crank", "rad", "1", "knee", "rad", "2", "/lift", "m", "3", "ram", "m"]
    assert cells[-6:] == ["2", "tip", "crank, knee, /lift", "3", "slider", "ram"]
    assert "color:" not in page.replace("border-color:", "")


def test_tensors_that_want_gradients_are_refused(packages: tuple[Any, Any]) -> None:
    torch = pytest.importorskip("torch")
    robot = packages[0].load("torch")
    q, qd, qdd = map(torch.tensor, (Q, QD, QDD))
    with pytest.raises(TypeError, match=r"call under torch\.no_grad"):
        robot.labelled("partial_torque", q.requires_grad_(), qd, qdd)
    with torch.no_grad():
        answer = robot.labelled("partial_torque", q, qd, qdd)
    np.testing.assert_array_equal(answer, robot.partial_torque(Q, QD, QDD))


def test_tables_are_taken_by_the_names_of_their_columns(packages: tuple[Any, Any]) -> None:
    pd, pl = (pytest.importorskip(name) for name in ("pandas", "polars"))
    robot = packages[0].load("numpy")
    turned = [2, 0, 3, 1]
    names = [robot.joint_names[k] for k in turned]
    expected = robot.gravity_torque(Q)
    for table in (pd.DataFrame(Q[:, turned], columns=names), pl.DataFrame(Q[:, turned], schema=names)):
        np.testing.assert_array_equal(robot.labelled("gravity_torque", table), expected)
    row = pd.Series(Q[1, turned], index=names)
    np.testing.assert_array_equal(robot.labelled("gravity_torque", row), expected[1])
    frame = pd.DataFrame(Q, columns=list(robot.joint_names)).rename_axis("frame")
    assert robot.labelled("gravity_torque", frame).dims == ("frame", "joint")
    with pytest.raises(ValueError, match="q has no joint 'crank'; it has 0, 1, 2, 3"):
        robot.labelled("gravity_torque", pd.DataFrame(Q))


def test_arrays_in_other_units_or_without_joints_are_refused(packages: tuple[Any, Any]) -> None:
    robot = packages[0].load("numpy")
    q = xr.DataArray(Q, dims=("trial", "joint"), attrs={"units": "deg"})
    with pytest.raises(ValueError, match="q is in deg; give it in rad and m"):
        robot.labelled("gravity_torque", q)
    with pytest.raises(ValueError, match=r"q has the dimensions \(trial, joints\); call that of the joints"):
        robot.labelled("gravity_torque", xr.DataArray(Q, dims=("trial", "joints")))
