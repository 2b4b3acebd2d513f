"""The analysis against the package's own calls, and what motions modelled on the paper's show."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from helpers.motion_logs import JOINTS, LEG, PLANAR3, PUMA560, smooth, write_csv, write_mot
from linkwise import Options, generate, read_system, write_package
from linkwise.analysis import Lowpass, Processing, Reading, analyze, stream
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.paper_motions import MOTIONS, SIMULATED, write_motions
from linkwise.analysis.verify import Closure
from linkwise.errors import LinkwiseError
from linkwise.package.load import Package


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    (path,) = write_motions(tmp_path_factory.mktemp("motion"), [SIMULATED])
    return analyze(path, PLANAR3)


def test_arrays_are_the_packages(tmp_path):
    names = [f"joint{i}" for i in range(1, 7)]
    result = analyze(write_csv(tmp_path / "a.csv", smooth(60, 6), names), PUMA560)
    model = load_robot(PUMA560).model
    motion = result.q, result.qd, result.qdd
    propagation = model.propagation(*motion)
    np.testing.assert_allclose(result.torque, model.inverse_dynamics(*motion), atol=1e-12)
    np.testing.assert_allclose(result.partial_torque, model.partial_torque(*motion), atol=1e-12)
    for field in ("acceleration", "velocity", "gravity"):
        np.testing.assert_allclose(
            getattr(result, field), getattr(propagation, field), atol=1e-12, err_msg=field
        )
    assert result.closure.terms_relative < 1e-12
    assert result.closure.links_relative < 1e-12


def test_partial_torques_sum_to_the_joint_torques(simulated):
    scale = np.abs(simulated.partial_torque).sum(-1)
    error = np.abs(simulated.partial_torque.sum(-1) - simulated.torque)
    assert (error <= 1e-12 * scale).all()


def test_nothing_propagates_from_a_joint_at_rest(simulated):
    rests = simulated.time <= 3.0
    assert rests.sum() == 301
    for term in (simulated.velocity, simulated.acceleration):
        assert np.abs(term[rests, 0, 1, 1]).max() == 0.0
        assert np.abs(term[~rests, 0, 1, 1]).max() > 1e-3
    assert np.abs(simulated.partial_torque[rests, 0, 1]).min() > 1.0


def test_a_result_is_told_in_a_line(simulated):
    assert repr(simulated) == (
        f"<analysis of simulated.csv: {len(simulated.time)} samples, 3 joints, 3 links, "
        f"{len(simulated.columns)} columns>"
    )


def test_columns_by_name_and_totals(simulated):
    np.testing.assert_array_equal(simulated["tau/joint1/link2"], simulated.partial_torque[:, 0, 1])
    np.testing.assert_array_equal(
        simulated["tau_qdd/joint1/link3/joint2"], simulated.acceleration[:, 0, 2, 1]
    )
    np.testing.assert_allclose(simulated.totals.mean, np.abs(simulated.values).mean(axis=1))
    np.testing.assert_array_equal(simulated.totals.peak, np.abs(simulated.values).max(axis=1))
    with pytest.raises(LinkwiseError, match="no column 'tau/x'"):
        simulated["tau/x"]


def test_record_says_how(simulated):
    record = simulated.record()
    assert record["processing"] == {
        "derivative": "five-point",
        "lowpass": None,
        "edges": "one-sided",
        "convention": "closing",
        "start": None,
        "stop": None,
    }
    assert record["samples"] == 601
    assert record["rate_hz"] == pytest.approx(100)
    assert {column["unit"] for column in record["columns"]} == {
        "s", "rad", "rad/s", "rad/s²", "N·m", "W",
    }  # fmt: skip


@pytest.mark.parametrize("derivative", ["five-point", "savitzky-golay"])
def test_blocks_do_not_show(tmp_path, monkeypatch, derivative):
    path = write_csv(tmp_path / "a.csv", smooth(203, 3))
    processing = Processing(derivative, lowpass=Lowpass(8.0))
    whole = analyze(path, PLANAR3, processing=processing)
    monkeypatch.setattr(stream, "INNER", 16)
    monkeypatch.setattr(stream, "BLOCK_BYTES", 1)
    parts = analyze(path, PLANAR3, processing=processing)
    np.testing.assert_allclose(parts.values, whole.values, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(parts.totals.mean, whole.totals.mean, rtol=1e-12)
    np.testing.assert_allclose(parts.work.given, whole.work.given, rtol=1e-12)
    np.testing.assert_allclose(parts.joint_work.taken, whole.joint_work.taken, rtol=1e-12)


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_progress_counts_up_to_the_end_of_each_stage(tmp_path, monkeypatch, kind):
    monkeypatch.setattr(stream, "BLOCK_BYTES", 1)
    path, table = tmp_path / f"a.{kind}", smooth(70_000, 3)
    if kind == "csv":
        write_csv(path, table)
    else:
        pq.write_table(pa.table(dict(zip(["time", *JOINTS], table.T, strict=True))), path)
    seen = {"reading": [], "analysing": []}

    def told(stage, done, whole):
        seen[stage].append((done, whole))

    analyze(path, PLANAR3, processing=Processing(edges="trim"), progress=told)
    for steps in seen.values():
        done = [step for step, _ in steps]
        assert len(done) > 1
        assert done[0] > 0
        assert done == sorted(set(done))
        assert {whole for _, whole in steps} == {done[-1]}


def test_gradient_convention_doubles_the_velocity_terms(tmp_path):
    path = write_csv(tmp_path / "a.csv", smooth(30, 3))
    closing = analyze(path, PLANAR3)
    gradient = analyze(path, PLANAR3, processing=Processing(convention="gradient"))
    np.testing.assert_allclose(gradient.velocity, 2 * closing.velocity, rtol=1e-12)
    np.testing.assert_array_equal(gradient.acceleration, closing.acceleration)
    assert gradient.closure.terms_relative < 1e-12


def test_trimmed_edges(tmp_path):
    path = write_csv(tmp_path / "a.csv", smooth(30, 3))
    whole = analyze(path, PLANAR3)
    inner = analyze(path, PLANAR3, processing=Processing(edges="trim"))
    np.testing.assert_array_equal(inner.values, whole.values[:, 2:-2])


def test_too_few_samples(tmp_path):
    path = write_csv(tmp_path / "a.csv", smooth(4, 3))
    with pytest.raises(LinkwiseError, match=r"a.csv: 4 samples, but the five-point formula needs 5"):
        analyze(path, PLANAR3)


def test_a_cutoff_too_low_to_be_computed_is_named(tmp_path):
    path = write_csv(tmp_path / "a.csv", smooth(30, 3))
    with pytest.raises(
        LinkwiseError, match=r"a.csv: --cutoff 1e-09 Hz is too low for a sampling rate of 100"
    ):
        analyze(path, PLANAR3, processing=Processing(lowpass=Lowpass(1e-9)))


def test_a_robot_that_does_not_close_is_refused():
    Closure(terms_relative=1e-13).check()
    for bad in (1e-3, float("nan")):
        with pytest.raises(LinkwiseError, match="do not close"):
            Closure(links_relative=bad).check()


def test_robot_directories_that_are_none(tmp_path):
    with pytest.raises(LinkwiseError, match="no generated robot there"):
        load_robot(tmp_path)
    (tmp_path / "manifest.json").write_text("{", encoding="utf-8")
    with pytest.raises(LinkwiseError, match=r"manifest.json is damaged"):
        load_robot(tmp_path)
    with pytest.raises(LinkwiseError, match="no back end for the analysis"):
        load_robot(PLANAR3, "no-such")


def test_a_back_end_that_cannot_load_gives_way_to_the_next(monkeypatch):
    load, failing = Package.load, {"native"}

    def partly(package, backend):
        if backend in failing:
            raise OSError("no compiler")
        return load(package, backend)

    monkeypatch.setattr(Package, "load", partly)
    assert load_robot(PLANAR3).backend == "numpy"
    failing |= {"numpy", "torch", "autograd"}
    with pytest.raises(LinkwiseError, match=r"no back end for the analysis \(native: no compiler; numpy: "):
        load_robot(PLANAR3)


def test_motions_modelled_on_the_paper():
    for motion in MOTIONS.values():
        time, q = motion.samples()
        assert np.isfinite(q).all()
        np.testing.assert_array_equal(q, motion.samples()[1])
        np.testing.assert_allclose(np.diff(time), 0.01)
    time, q = SIMULATED.samples()
    early = time <= 3.02
    assert np.ptp(q[early, 1]) == 0 == np.ptp(q[:, 0])
    assert np.ptp(q[early, 2]) > 0.5 < np.ptp(q[~early, 1])


def test_walking_with_a_planar_leg(tmp_path):
    """A log like OpenSim's inverse kinematics: degrees, 60 Hz, more columns than the leg has joints."""
    from linkwise import pipeline
    from linkwise.package.write import write_package

    write_package(pipeline.generate(pipeline.read_system(str(LEG)), ["numpy"]), tmp_path / "leg")
    legs = ["pelvis_tx", "pelvis_ty", "pelvis_tilt", "hip_flexion_r", "knee_angle_r", "ankle_angle_r"]
    names = ["pelvis_tilt", "pelvis_list", *legs[:2], *legs[3:], "lumbar_bending"]
    table = smooth(73, 8, rate=60) * [1, 5, 2, 0.02, 0.02, 30, 60, 15, 3]
    table[:, 3:5] += [0.6, 1.04]
    path = write_mot(tmp_path / "walk.mot", table, names)
    with pytest.raises(LinkwiseError, match="no joint for column 'pelvis_list', 'lumbar_bending'"):
        analyze(path, tmp_path / "leg")
    result = analyze(path, tmp_path / "leg", Reading(ignore_extra=True), Processing(lowpass=Lowpass(6.0)))
    assert result.ignored == ("pelvis_list", "lumbar_bending")
    assert result.robot.links == ("pelvis", "thigh", "shank", "foot")
    assert result.closure.terms_relative < 1e-12
    units = {column.name: column.unit for column in result.columns}
    assert (units["tau/pelvis_ty"], units["tau/knee_angle_r"]) == ("N", "N·m")
    assert (
        units["power/pelvis_ty"] == units["power/pelvis_ty/foot"] == units["power/knee_angle_r/foot"] == "W"
    )
    assert result.closure.energy_relative < 1e-12
    weight = 9.80665 * (50.85 + 7.5 + 3.49 + 1.09)
    np.testing.assert_allclose(result.gravity[:, 1].sum(-1), weight)


def test_parquet_in_parquet_out(tmp_path):
    """A result is itself a log: its q columns come back by --map."""
    import pyarrow as pa

    table = smooth(20, 3)
    named = {"time": table[:, 0].copy()} | {f"q/{n}": table[:, 1 + i].copy() for i, n in enumerate(JOINTS)}
    pq.write_table(pa.table(named), tmp_path / "a.parquet")
    reading = Reading(mapping=tuple((f"q/{name}", name) for name in JOINTS))
    np.testing.assert_array_equal(analyze(tmp_path / "a.parquet", PLANAR3, reading).q, table[:, 1:])


@pytest.mark.parametrize("backend", ["torch", "autograd"])
def test_tensor_back_ends_give_the_same(tmp_path, backend):
    pytest.importorskip("torch")
    path = write_csv(tmp_path / "a.csv", smooth(20, 3))
    for convention in ("closing", "gradient"):
        processing = Processing(convention=convention)
        ours = analyze(path, load_robot(PLANAR3, backend), processing=processing)
        other = analyze(path, load_robot(PLANAR3, "numpy"), processing=processing)
        assert ours.robot.backend == backend
        np.testing.assert_allclose(ours.values, other.values, rtol=1e-9, atol=1e-10)


def test_partial_torques_are_those_of_an_independent_recursion(tmp_path):
    path = write_csv(tmp_path / "a.csv", smooth(60, 6), [f"joint{i}" for i in range(1, 7)])
    result = analyze(path, PUMA560)
    assert result.closure.recursion_absolute > 0
    assert result.closure.recursion_relative < 1e-12
    by_hand = replace(result.robot, recursion=None, tree=None)
    assert analyze(path, by_hand).closure.recursion_relative is None


def test_a_robot_at_odds_with_the_recursion_is_refused(tmp_path):
    """Sums cannot see every torque being too large by the same part."""
    path = write_csv(tmp_path / "a.csv", smooth(60, 3))
    robot = load_robot(PLANAR3)
    heavy = deepcopy(robot.recursion)
    *others, last = heavy.links
    heavy.links = (*others, replace(last, mass=1.001 * last.mass))
    with pytest.raises(LinkwiseError, match=r"a.csv: .* not those of the Newton-Euler recursion"):
        analyze(path, replace(robot, recursion=heavy))


@pytest.mark.parametrize("value", [1e306, 1.7e308])
@pytest.mark.parametrize("lowpass", [None, Lowpass(5.0)])
def test_results_that_overflow_are_named(tmp_path, lowpass, value):
    table = smooth(60, 3)
    table[30, 2] = value
    path = write_csv(tmp_path / "a.csv", table)
    message = (
        r"a.csv: row \d+, time 0[.\d]* s: result column '(q|tau).*/joint.' is -?(inf|nan); the log's values"
    )
    with pytest.raises(LinkwiseError, match=message) as error:
        analyze(path, PLANAR3, Reading(units="rad"), Processing(lowpass=lowpass))
    if lowpass is None:
        assert str(error.value).endswith(f"too large: 'joint2' comes to {value:.3g} in row 32")


def test_a_coordinate_that_overflows_in_the_filter_is_named(tmp_path):
    table = smooth(60, 3)
    table[::2, 2] = 1.7e308
    path = write_csv(tmp_path / "a.csv", table)
    with pytest.raises(LinkwiseError, match=r"values are too large: 'joint2' overflows in the filter$"):
        analyze(path, PLANAR3, Reading(units="rad"), Processing(lowpass=Lowpass(5.0)))


def test_slashes_in_names_are_escaped(tmp_path):
    robot = load_robot(PLANAR3)
    names = ("a", "a/b", "a%2Fb")
    slashed = replace(robot, joints=names, links=("b/a", "a", "link"))
    result = analyze(write_csv(tmp_path / "a.csv", smooth(20, 3), names), slashed)
    columns = [column.name for column in result.columns]
    assert len(set(columns)) == len(columns)
    np.testing.assert_array_equal(result["tau/a%2Fb/link"], result.partial_torque[:, 1, 2])
    np.testing.assert_array_equal(result["tau/a%252Fb"], result.torque[:, 2])


def test_a_log_near_a_bases_pole_says_how_near(tmp_path):
    robot = tmp_path / "box.urdf"
    inertia = '<inertia ixx="0.1" iyy="0.2" izz="0.3" ixy="0" ixz="0" iyz="0"/>'
    robot.write_text(
        f'<robot name="box"><link name="box"><inertial><mass value="2"/>{inertia}</inertial></link></robot>'
    )
    names = [f"base_{name}" for name in ("x", "y", "z", "yaw", "pitch", "roll")]
    write_package(generate(read_system(robot, Options(base="floating")), ["numpy"]), tmp_path / "box")
    table = smooth(101, 6)
    for nearest, told in ((80.0, False), (89.0, True), (100.0, True)):
        table[:, 5] = np.radians(nearest - 30.0 * (table[:, 0] - 0.5) ** 2)
        warnings = analyze(write_csv(tmp_path / "a.csv", table, names), tmp_path / "box").warnings
        near = [text for text in warnings if "'base_pitch' is" in text]
        assert len(near) == told
        if nearest == 89.0:
            assert (
                "is 1 degrees from where 'base_yaw' and 'base_roll' turn about one axis, at 0.5 s" in near[0]
            )
            assert "wrong with these two by 57.3 times as much" in near[0]
