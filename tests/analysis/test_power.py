"""Power and work: what each joint sends into each link, against the energies of the links themselves."""

import json
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
from helpers.motion_logs import JOINTS, PLANAR3, PUMA560, smooth, write_csv
from linkwise.analysis import Processing, analyze
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.paper_motions import SIMULATED, write_motions
from linkwise.analysis.request import Outputs, Request
from linkwise.analysis.run import analyze_to
from linkwise.errors import LinkwiseError
from linkwise.progress import silent

LENGTH, CENTRE, MASS, INERTIA, G = 0.25, 0.125, 0.6, 5e-3, 9.80665
"""The arm of the paper's Table 2, of which generated/planar3 is made."""


def energies(q, qd):
    """K_j + P_j of planar3's links in J, (S, 3), by hand."""
    angle, rate = np.cumsum(q, axis=1), np.cumsum(qd, axis=1)
    out = []
    end, speed = np.zeros((2, len(q), 2))
    for j in range(3):
        along = np.stack([np.cos(angle[:, j]), np.sin(angle[:, j])], axis=1)
        across = np.stack([-along[:, 1], along[:, 0]], axis=1) * rate[:, j, None]
        v = speed + CENTRE * across
        kinetic = 0.5 * MASS * (v**2).sum(axis=1) + 0.5 * INERTIA * rate[:, j] ** 2
        out.append(kinetic + MASS * G * (end + CENTRE * along)[:, 1])
        end, speed = end + LENGTH * along, speed + LENGTH * across
    return np.stack(out, axis=1)


@pytest.fixture(scope="module")
def there_and_back(tmp_path_factory):
    """Two seconds at 1 kHz from rest to rest in the same place, with stillness before and after."""
    time = np.arange(2401) / 1000
    phase = np.clip((time - 0.2) / 2, 0, 1)
    bump = (np.sin(np.pi * phase) ** 4)[:, None] * [0.7, -1.1, 0.9]
    bump[:, 1] *= np.cos(3 * np.pi * phase)
    path = tmp_path_factory.mktemp("log") / "a.csv"
    return analyze(write_csv(path, np.column_stack([time, bump])), PLANAR3)


def test_power_into_a_link_is_the_gain_of_its_energy(there_and_back):
    result = there_and_back
    gain = np.gradient(energies(result.q, result.qd), result.time, axis=0)
    inner = slice(4, -4)
    np.testing.assert_allclose(
        result.power.sum(axis=1)[inner], gain[inner], atol=1e-4 * np.abs(result.power).max()
    )
    np.testing.assert_array_equal(result.power, result.partial_torque * result.qd[:, :, None])
    np.testing.assert_array_equal(result.joint_power, result.torque * result.qd)


def test_a_movement_there_and_back_leaves_no_work_in_any_link(there_and_back):
    work = there_and_back.work
    assert (work.given.sum(axis=0) > 0.1).all()
    np.testing.assert_allclose(work.net.sum(axis=0), 0, atol=1e-7)
    assert np.abs(work.net).max() > 0.1  # through a link, one joint's work comes out at another


def test_work_is_the_integral_of_the_power(there_and_back):
    result = there_and_back
    for power, work in ((result.power, result.work), (result.joint_power, result.joint_work)):
        given = np.trapezoid(np.maximum(power, 0), result.time, axis=0)
        taken = np.trapezoid(np.maximum(-power, 0), result.time, axis=0)
        np.testing.assert_allclose(work.given, given, rtol=1e-11, atol=1e-15)
        np.testing.assert_allclose(work.taken, taken, rtol=1e-11, atol=1e-15)
        np.testing.assert_allclose(work.net, given - taken, atol=1e-11)
    assert (result.work.given[1:, 0] == 0).all()  # joint 2 does not move link 1


def test_work_counts_a_motion_from_its_first_sample_to_its_last(tmp_path):
    result = analyze(write_csv(tmp_path / "a.csv", smooth(30, 3)), PLANAR3)
    assert (np.abs(result.joint_power[[0, 1, -2, -1]]) > 1e-3).all()
    net = np.trapezoid(result.joint_power, result.time, axis=0)
    np.testing.assert_allclose(result.joint_work.net, net, rtol=1e-11)


def test_joints_at_rest_send_no_power(tmp_path):
    """Until 3 s only joint 3 moves in the paper's simulated motion, though the others carry torque."""
    (path,) = write_motions(tmp_path, [SIMULATED])
    result = analyze(path, PLANAR3)
    rests = result.time <= 3.0
    assert np.abs(result.partial_torque[rests, 0, 2]).max() > 0.5
    assert (result.power[rests, :2] == 0).all()
    assert np.abs(result.power[rests, 2, 2]).max() > 0.1
    assert (result.work.given[0] == 0).all()  # joint 1 rests to the end


@pytest.mark.parametrize("convention", ["closing", "gradient"])
def test_power_by_cause_and_order_is_written_where_asked_for(tmp_path, convention):
    log = write_csv(tmp_path / "a.csv", smooth(40, 3))
    wanted = Outputs(power_terms=True, page=False)
    processing = Processing(convention=convention)
    analyze_to(
        tmp_path / "out", log, load_robot(PLANAR3), Request(processing=processing, outputs=wanted), silent
    )
    table = pq.read_table(tmp_path / "out" / "analysis.parquet")
    read = {name: table[name].to_numpy() for name in table.column_names}
    terms = [name for name in read if name.startswith("power_")]
    assert {name.partition("/")[0] for name in terms} == {"power_qdd", "power_qd", "power_gravity"}
    for name in terms:
        joint = name.split("/")[1]
        np.testing.assert_array_equal(read[name], read[name.replace("power", "tau", 1)] * read[f"qd/{joint}"])
        assert table.schema.field(name).metadata[b"unit"] == b"W"
    counted = {"power_qd": 0.5 if convention == "gradient" else 1.0}
    parts = [name.split("/") for name in terms if name.split("/")[1:3] == ["joint1", "link3"]]
    whole = sum(counted.get(kind, 1.0) * read["/".join([kind, *rest])] for kind, *rest in parts)
    np.testing.assert_allclose(whole, read["power/joint1/link3"], rtol=1e-11, atol=1e-13)
    columns = json.loads((tmp_path / "out/analysis.json").read_text(encoding="utf-8"))["columns"]
    assert [column["name"] for column in columns] == table.column_names


def test_the_record_lists_the_work_of_every_pair(there_and_back):
    record = there_and_back.record()["work"]
    pairs = {(entry["joint"], entry["link"]): entry for entry in record["into_links"]}
    assert len(pairs) == 6
    entry = pairs["joint1", "link3"]
    work = there_and_back.work
    assert entry["given"] == work.given[0, 2]
    assert entry["taken_back"] == work.taken[0, 2]
    assert entry["net"] == work.net[0, 2]
    assert [entry["joint"] for entry in record["of_joints"]] == list(JOINTS)


def test_power_agrees_with_the_energies_of_the_recursion(tmp_path):
    path = write_csv(tmp_path / "a.csv", smooth(60, 6), [f"joint{i}" for i in range(1, 7)])
    closure = analyze(path, PUMA560).closure
    assert closure.energy_absolute > 0
    assert closure.energy_relative < 1e-12


def test_power_at_odds_with_the_links_energies_is_refused(tmp_path):
    path = write_csv(tmp_path / "a.csv", smooth(60, 3))
    robot = load_robot(PLANAR3)
    odd = deepcopy(robot.recursion)
    known = odd.energies
    odd.energies = lambda q, qd: tuple(1.001 * energy for energy in known(q, qd))
    with pytest.raises(LinkwiseError, match=r"a.csv: .*power .* not the gain of the links' energies"):
        analyze(path, replace(robot, recursion=odd))


def test_rounding_alone_is_not_taken_for_a_fault(tmp_path):
    """Joint 1 turns evenly about the vertical axis: no power but rounding, beside a heavy arm at rest."""
    table = np.zeros((60, 7))
    table[:, 0] = np.arange(60) / 100
    table[:, 1] = 3 * table[:, 0]
    table[:, 2:] = 0.3
    path = write_csv(tmp_path / "a.csv", table, [f"joint{i}" for i in range(1, 7)])
    assert analyze(path, PUMA560).closure.energy_relative < 1e-9
