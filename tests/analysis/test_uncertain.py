"""Deviations in an analysis: columns against draws of bodies, signs and sentence, and what is refused."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA
from helpers.command_line import run_linkwise
from helpers.motion_logs import PLANAR3, smooth, write_csv
from helpers.studies import CHOICES, HEAD, Here
from helpers.urdf_text import chain, joint, link, robot
from linkwise import (
    Contact,
    Contacts,
    LinkwiseError,
    Load,
    Payload,
    Processing,
    generate,
    read_system,
    write_package,
)
from linkwise.analysis import analyze
from linkwise.analysis.certain_signs import plus_minus
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.settings import Reading
from linkwise.package.load import import_package
from linkwise.study import run_study
from linkwise_runtime.certainty.uncertain_bodies import UncertainBodies

JOINTS = ("ab", "bc", "cd")
ARM = chain(joint("ab", "a", "b"), joint("bc", "b", "c", type="prismatic"), joint("cd", "c", "d"))
FILE = """schema = 1
[all]
mass = "10 %"
centre = "10 mm"
radii = "8 %"
[link.d]
mass = "0.3 kg"
centre = ["5 mm", "4 cm", "20 mm"]
[body_mass]
sd = "5 %"
links = ["b", "d"]
[correlation]
links = ["d", "c"]
matrix = [[1.0, -0.6], [-0.6, 1.0]]
"""
SAME = UncertainBodies(
    np.array([0.1, 0.1, 0.2]),
    np.array([[0.01] * 3, [0.01] * 3, [0.005, 0.04, 0.02]]),
    np.full(3, 0.08),
    0.05,
    np.array([1.0, 0.0, 1.0]),
    np.array([[1.0, 0.0, 0.0], [0.0, 1.0, -0.6], [0.0, -0.6, 1.0]]),
)
"""The file as it is to be read; each link of the arm has 1.5 kg."""


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of an arm, whose file's axes are not those of its joints, a log, and what is uncertain."""
    folder = tmp_path_factory.mktemp("uncertain")
    (folder / "arm.urdf").write_text(ARM)
    write_package(generate(read_system(folder / "arm.urdf"), ["numpy", "torch", "autograd"]), folder / "arm")
    write_csv(folder / "log.csv", smooth(60, 3), JOINTS)
    (folder / "bodies.toml").write_text(FILE)
    return folder


@pytest.mark.parametrize("backend", ["numpy", "torch"])
def test_columns_are_the_deviations_of_drawn_bodies(arm: Path, backend: str) -> None:
    pin = pytest.importorskip("pinocchio")
    from numeric.drawn_bodies import Oracle, agree

    result = analyze(arm / "log.csv", load_robot(arm / "arm", backend), uncertain=arm / "bodies.toml")
    oracle = Oracle(pin.buildModelFromUrdf(str(arm / "arm.urdf")), import_package(arm / "arm").tree.TREE)
    drawn = oracle.drawn(SAME, 3)
    for s in (7, 40):
        motion = [a[s] for a in (result.q, result.qd, result.qdd)]
        c2, c1, g = oracle.shares(*motion)
        for name, rows in (
            ("tau_qdd", c2),
            ("tau_qd", c1),
            ("tau_gravity", g),
            ("tau_link", oracle.rows(*motion)),
        ):
            agree(result.dense(f"sd/{name}")[s], np.einsum("ij...p,djp->dij...", rows, drawn).std(0))
        whole = np.einsum("ijp,djp->di", oracle.rows(*motion), drawn)
        agree(result.dense("sd/tau")[s], whole.std(0))


def test_a_deviation_stands_for_each_torque_with_its_name_and_unit(arm: Path) -> None:
    result = analyze(arm / "log.csv", arm / "arm", uncertain=arm / "bodies.toml")
    units = {column.name: column.unit for column in result.columns}
    prefixes = ("tau/", "tau_qdd/", "tau_qd/", "tau_gravity/", "power/")
    names = [name for name in units if name.startswith(prefixes)]
    assert {f"sd/{name}" for name in names} == {name for name in units if name.startswith("sd/")}
    assert all(units[f"sd/{name}"] == units[name] for name in names)
    assert result.closure.terms_relative < 1e-13
    twice = analyze(
        arm / "log.csv",
        arm / "arm",
        processing=Processing(convention="gradient"),
        uncertain=arm / "bodies.toml",
    )
    np.testing.assert_allclose(twice.dense("sd/tau_qd"), 2.0 * result.dense("sd/tau_qd"), rtol=1e-12)
    plain = analyze(arm / "log.csv", arm / "arm")
    assert plain.peaks == ()
    assert not [column for column in plain.columns if column.name.startswith("sd/")]
    pytest.importorskip("xarray")
    named = result.to_xarray()
    found = named.propagation_sd.sel(joint="ab", link="d", cause="cd", order="velocity")
    np.testing.assert_array_equal(found, result["sd/tau_qd/ab/d/cd"])
    np.testing.assert_array_equal(named.torque_sd.sel(joint="ab"), result["sd/tau/ab"])


def test_signs_and_sentence_are_those_of_the_largest_magnitudes(arm: Path) -> None:
    (arm / "rough.toml").write_text('schema = 1\n[all]\nmass = "30 %"\ncentre = "60 mm"\nradii = "30 %"\n')
    ended = run_linkwise(
        "analyze", "log.csv", "--robot", "arm", "--out", "rough", "--uncertain", "rough.toml", folder=arm
    )
    assert ended.returncode in (0, None), ended.stderr
    result = analyze(arm / "log.csv", arm / "arm", uncertain=arm / "rough.toml")
    largest, unsure, counted = {}, [], 0
    for column in result.columns:
        if column.quantity in ("tau_qdd", "tau_qd", "tau_gravity"):
            values, deviations = result[column.name], result[f"sd/{column.name}"]
            at = int(np.abs(values).argmax())
            most = max(
                np.abs(result[c.name]).max()
                for c in result.columns
                if c.joint == column.joint and c.quantity.startswith("tau")
            )
            if abs(values[at]) > 1e-3 * most:
                certain, counted = abs(values[at]) >= 2.0 * deviations[at], counted + 1
                unsure += [] if certain else [column.name]
                if certain and column.quantity == "tau_qd":
                    largest[column.name] = values[at], deviations[at], result.time[at]
    record = json.loads((arm / "rough/analysis.json").read_text())["uncertain"]
    assert {one["name"] for one in record["without_certain_sign"]} == set(unsure)
    assert unsure
    assert record["shares"] == counted > len(unsure)
    assert not record["covariance_of_parameters"]
    name = max(largest, key=lambda name: abs(largest[name][0]))
    (value, deviation, time), (_, i, j, k) = largest[name], name.split("/")
    told = f"the velocity of {k} asked {i} for {plus_minus(value, deviation)}"
    assert record["sentence"].startswith(told)
    assert record["sentence"].endswith(f" through {j} at {time:.2f} s")
    assert f"{len(unsure)} of {record['shares']} shares have no certain sign" in ended.stdout
    assert record["sentence"] in ended.stdout
    assert record["sentence"] in result.provenance


def test_shares_about_zero_and_loads_have_signs_too(arm: Path) -> None:
    table = smooth(60, 3)
    table[:, 1:] = table[7, 1:]
    write_csv(arm / "still.csv", table, JOINTS)
    (arm / "shaky.toml").write_text(
        'schema = 1\n[motion]\nangle = "1 deg"\nlength = "1 mm"\n[loads]\nforce = "9 N"\n'
    )
    result = analyze(
        arm / "still.csv",
        arm / "arm",
        loads=[Load("push", "d", [0.0, 3.0, 0.0])],
        uncertain=arm / "shaky.toml",
    )
    told = {peak.column.name: peak for peak in result.signs.uncertain}
    assert {"tau_qdd/ab/d/ab", "tau_load/ab/push"} <= set(told)
    assert told["tau_qdd/ab/d/ab"].value == pytest.approx(0.0, abs=1e-9)
    assert told["tau_load/ab/push"].deviation > abs(told["tau_load/ab/push"].value)


def test_a_load_may_be_uncertain_in_its_own_way(arm: Path) -> None:
    path = arm / "apart.toml"
    path.write_text('schema = 1\n[loads]\nforce = "1 N"\n[load.second]\nforce = "3 N"\n')
    loads = [Load(name, "d", [0.0, 3.0, 0.0]) for name in ("first", "second")]
    result = analyze(arm / "log.csv", arm / "arm", loads=loads, uncertain=path)
    one, other = (result[f"sd/tau_load/ab/{load.name}"] for load in loads)
    np.testing.assert_allclose(other, 3.0 * one, rtol=1e-9)
    assert one.min() > 0
    path.write_text(path.read_text().replace("second", "third"))
    with pytest.raises(LinkwiseError, match=r"\[load\.third\]: there is no load 'third'; loads are first, s"):
        analyze(arm / "log.csv", arm / "arm", loads=loads, uncertain=path)


def test_a_sentence_says_where_velocities_count_twice(arm: Path) -> None:
    how = Processing(convention="gradient")
    result = analyze(arm / "log.csv", arm / "arm", processing=how, uncertain=arm / "bodies.toml")
    assert result.signs.sentence.endswith(" s (gradient convention)")


def test_bands_of_the_figure_are_one_deviation_to_either_side(arm: Path) -> None:
    pytest.importorskip("matplotlib")
    result = analyze(arm / "log.csv", arm / "arm", uncertain=arm / "bodies.toml")
    figure = result.figure("paper:ab")
    torques, partial = figure.axes[1:3]
    for axis, name in ((torques, "tau/ab"), (partial, "tau/ab/b")):
        corners = axis.patches[0].get_xy()[:-1, 1]
        value, deviation = result[name], result[f"sd/{name}"]
        expected = np.concatenate([value - deviation, (value + deviation)[::-1]])
        np.testing.assert_allclose(corners, expected, rtol=1e-12)
    assert not figure.axes[0].patches
    assert not analyze(arm / "log.csv", arm / "arm").figure("paper:ab").axes[1].patches


@pytest.mark.parametrize(
    ("value", "deviation", "told"),
    [
        (-8.71, 0.92, "-8.7 ± 0.9"),
        (12.3456, 0.138, "12.35 ± 0.14"),
        (1234.0, 87.0, "1234 ± 87"),
        (0.5, 0.0996, "0.50 ± 0.10"),
        (2.0, 0.0, "2 ± 0"),
    ],
)
def test_a_value_has_as_many_digits_as_its_deviation_tells(value: float, deviation: float, told: str) -> None:
    assert plus_minus(value, deviation) == told


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('[all]\nmass = "-10 %"', "[all]: mass is -10 %; a standard deviation is 0 or more"),
        ("[all]\nmass = 10", "[all]: mass is 10; write a number and its unit, % or kg"),
        ('[all]\ncentre = "10 %"', "[all]: centre is '10 %'; write a number and its unit, mm or cm or m"),
        ('[all]\nmass = "200 %"', "200 % of what it is of; give 100 % at most"),
        ('[link.hand]\nmass = "10 %"', "[link.hand]: planar3 has no link 'hand'; its links are"),
        ('[joint.wrist]\nlength = "1 mm"', "[joint.wrist]: planar3 has no joint 'wrist'; its joints are"),
        ('[link.link1]\nmas = "10 %"', "[link.link1] has the unknown key 'mas'"),
        ('[all]\ncentre = ["1 mm", "2 mm"]', "[all]: centre has 2 numbers"),
        ("[body_mass]\n", '[body_mass] needs sd, such as "2 %"'),
        ('[body_mass]\nsd = "200 %"', "[body_mass]: sd is 200 %; give 100 % at most"),
        ('[body_mass]\nsd = "2 %"\nlinks = ["hand"]', "[body_mass]: planar3 has no link 'hand'"),
        (
            '[correlation]\nlinks = ["link1", "link2"]\nmatrix = [[1, 2], [2, 1]]',
            "[correlation]: correlation of 'link1' and 'link2' is 2; give one from -1 to 1",
        ),
        (
            '[correlation]\nlinks = ["link1", "link2"]\nmatrix = [[1, 0.5]]',
            "[correlation] needs matrix, 2 rows of 2 numbers",
        ),
        ("", "nothing is uncertain; give [all], [link.NAME], [motion] or [loads]"),
        ('motion = "1 mm"', "[motion] must be a table"),
        ("[motion]", "[motion] states no noise; give angle, length or a joint's sd, or estimate = true"),
        ('[motion]\nangle = "-1 deg"', "[motion]: angle is -1 deg; a standard deviation is 0 or more"),
        ('[motion.joint.wrist]\nsd = "1 deg"', "[motion.joint.wrist]: planar3 has no joint 'wrist'"),
        ("[motion]\nestimate = true\nangle = '1 deg'", "[motion]: estimate = true goes alone"),
        ("[motion]\nestimate = true", "takes what a filter took away for noise, and nothing was"),
        ('[loads]\nforce = "5 N"', "[loads] states how uncertain loads are, and planar3 bears none here"),
        (
            '[load.plate]\nforce = "5 kg"',
            "[load.plate]: force is '5 kg'; write a number and its unit, N, as in",
        ),
        ('[all]\nmass = "0 %"', "all deviations of bodies are 0; give some, or leave these tables out"),
        (
            '[all]\nradii = "1 %"\n[correlation]\nlinks = ["link1", "link2"]\nmatrix = [[1, 0], [0, 1]]',
            "[correlation]: the mass of 'link1' is certain; give it a deviation of its own",
        ),
        ('[all]\naxis = "1 %"', "'axis' is not modelled: axes of joints count as certain"),
        ("[all\n", "malformed TOML"),
    ],
)
def test_a_bad_file_ends_in_one_line(text: str, told: str, tmp_path: Path) -> None:
    write_csv(tmp_path / "log.csv", smooth(20, 3))
    (tmp_path / "bad.toml").write_text(f"schema = 1\n{text}\n")
    flags = ("--robot", PLANAR3, "--out", "out", "--uncertain", "bad.toml")
    ended = run_linkwise("analyze", "log.csv", *flags, folder=tmp_path)
    assert ended.returncode == 2
    assert ended.stderr.count("\n") == 1
    assert "bad.toml: " in ended.stderr
    assert told in ended.stderr
    assert not (tmp_path / "out").exists()


def test_what_is_not_modelled_is_refused_by_name(arm: Path, tmp_path: Path) -> None:
    def refused(told: str, robot: Any = arm / "arm", file: str = "bodies", **more: Any) -> None:
        with pytest.raises(LinkwiseError, match=told) as info:
            analyze(arm / "log.csv", robot, uncertain=arm / f"{file}.toml", **more)
        assert "\n" not in str(info.value)

    refused("--uncertain: autograd has no regressors", load_robot(arm / "arm", "autograd"))
    write_package(generate(read_system(DATA / "cart_pendulum.py"), ["numpy"], "other"), tmp_path / "cart")
    refused("--uncertain: the links of .* are energies", tmp_path / "cart")
    (arm / "long.toml").write_text('schema = 1\n[all]\nlength = "1 mm"\n')
    held = Contacts((Contact("d", "point"),), unactuated=("ab", "bc", "cd"))
    for more in ({"payloads": [Payload("d", 1.0)]}, {"contacts": held}, {"reactions": ["cd"]}):
        refused("lengths count", file="long", **more)
    (arm / "carried.toml").write_text('schema = 1\n[link."payload d"]\nmass = "10 %"\n')
    refused("payloads count as certain", file="carried", payloads=[Payload("d", 1.0)])
    (arm / "noise.toml").write_text('schema = 1\n[motion]\nangle = "1 mrad"\n')
    refused("leave --resample out", file="noise", reading=Reading(resample=50.0))


def test_what_weighs_nothing_in_the_file_has_no_deviation_in_kg(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(robot(link("a"), link("b", "0"), joint("ab", "a", "b")))
    write_package(generate(read_system(tmp_path / "arm.urdf"), ["numpy"]), tmp_path / "arm")
    log = write_csv(tmp_path / "log.csv", smooth(20, 1), ["ab"])
    (tmp_path / "bodies.toml").write_text('schema = 1\n[link.b]\nmass = "0.1 kg"\n')
    with pytest.raises(LinkwiseError, match="'b' has no mass in the robot's file; give a part of it, in %"):
        analyze(log, tmp_path / "arm", uncertain=tmp_path / "bodies.toml")


def test_a_study_takes_the_file_as_a_key_and_works_anew_when_it_changes(tmp_path: Path) -> None:
    keys = f'{CHOICES}uncertain = "bodies.toml"\n'
    trial = '\n[[trial]]\nname = "a"\ncondition = "slow"\nlog = "a.csv"\nrobot = "planar3"\n'
    study = tmp_path / "study.toml"
    study.write_text("".join((HEAD, 'pages = false\ncolumns = ["tau/*", "sd/tau/*"]\n', keys, trial)))
    write_csv(tmp_path / "a.csv", smooth(30, 3))
    fresh = []
    for content in ("10 %", "10 %", "20 %"):
        (tmp_path / "bodies.toml").write_text(f'schema = 1\n[all]\nmass = "{content}"\n')
        fresh.append(run_study(study, tmp_path / "out", Here()).fresh)
    assert fresh == [1, 0, 1]
    arrow = pytest.importorskip("pyarrow.parquet")
    table = next((tmp_path / "out").rglob("a/*.parquet"))
    assert "sd/tau/joint1" in arrow.read_schema(table).names
