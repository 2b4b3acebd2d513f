"""Columns that are asked for: as among all, with nothing else computed, and nothing missing silently."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from helpers.command_line import run_linkwise
from helpers.motion_logs import LEG, PLANAR3, PUMA560, smooth, write_csv
from helpers.studies import CHOICES as READ
from helpers.studies import HEAD, TRIALS, Here, write_study
from linkwise import Contact, LinkwiseError, Load, generate, read_system, write_package
from linkwise.analysis import Processing, analyze, stream
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.worker_threads import LIMIT, worker_threads
from linkwise.study import run_study
from linkwise_runtime.dynamics import Dynamics

PUMA = [f"joint{i}" for i in range(1, 7)]
LEGS = ["pelvis_tx", "pelvis_ty", "pelvis_tilt", "hip_flexion_r", "knee_angle_r", "ankle_angle_r"]
SPRUNG = """
[[constraint]]
name = "gear"
type = "coupling"
terms = { ankle_angle_r = 1, knee_angle_r = [0.1, 0.5, 0.2] }
"""


def kinds(names: Any) -> set[str]:
    """First parts of names with the number of parts behind them: tau/1 is a joint's torque."""
    return {f"{name.partition('/')[0]}/{name.count('/')}" for name in names}


@pytest.fixture(scope="module")
def puma(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of 300 samples."""
    return write_csv(tmp_path_factory.mktemp("puma") / "log.csv", smooth(300, 6), PUMA)


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A leg whose ankle follows its knee by a coupling, and a log."""
    made = tmp_path_factory.mktemp("leg")
    (made / "coupled.toml").write_text(LEG.read_text() + SPRUNG)
    write_package(generate(read_system(made / "coupled.toml"), ["numpy"]), made / "coupled")
    moving = smooth(80, 6)
    moving[:, 1:] *= 0.4
    write_csv(made / "log.csv", moving[:, :-1], LEGS[:-1])  # the ankle follows
    return made


CHOICES: dict[str, tuple[tuple[str, ...], set[str]]] = {
    "sums": (("sums",), {"tau/1", "power/1"}),
    "causes": (
        ("causes",),
        {"tau/1", "power/1", "tau_qdd/3", "tau_qd/3", "tau_gravity/2", "tau_load/2"},
    ),
    "names": (("tau_gravity/joint1/*", "power/*/link3"), {"tau_gravity/2", "power/2", "tau/2"}),
    "parts": (("tau_load/**", "tau_qd/joint2/**"), {"tau_load/2", "tau_qd/3"}),
}


@pytest.mark.parametrize("backend", ["numpy", "native"])
@pytest.mark.parametrize("convention", ["closing", "gradient"])
@pytest.mark.parametrize("choice", CHOICES)
def test_what_is_asked_for_is_as_among_all_columns(
    choice: str, convention: Any, backend: str, puma: Path
) -> None:
    asked, expected = CHOICES[choice]
    robot, how = load_robot(PUMA560, backend), Processing(convention=convention)
    given: dict[str, Any] = {"loads": [Load("tool", "link6", (1.0, 2.0, 3.0))], "processing": how}
    whole, some = analyze(puma, robot, **given), analyze(puma, robot, columns=asked, **given)
    names = set(some.table)
    assert kinds(names) == {"time/0", "q/1", "qd/1", "qdd/1"} | expected
    for name in names:
        np.testing.assert_allclose(some[name], whole[name], rtol=1e-12, atol=1e-12, err_msg=name)
    assert all(
        name in names for name in whole.table if kinds([name]) & expected and choice in ("sums", "causes")
    )
    assert some.closure.recursion_relative is not None
    assert some.closure.recursion_relative < 1e-9
    assert 0 < some.closure.terms_relative < 1e-12
    assert some.record()["asked_columns"] == list(asked)
    assert some.record()["closure_is_of"].startswith("8 samples")
    assert (whole.record()["asked_columns"], whole.record()["closure_is_of"]) == (["all"], "every sample")


@pytest.mark.parametrize("contacts", [(), (Contact("foot", "held", (0.1, -0.06, 0.0), name="sole"),)])
@pytest.mark.parametrize("asked", [("sums",), ("causes",), ("tau/*",), ("force/**",), ("power/*/shank",)])
def test_tied_and_standing_robots_have_the_same(asked: tuple[str, ...], contacts: Any, leg: Path) -> None:
    how = Processing(edges="trim")
    whole = analyze(leg / "log.csv", leg / "coupled", processing=how, contacts=contacts)
    some = analyze(leg / "log.csv", leg / "coupled", processing=how, contacts=contacts, columns=asked)
    assert len(some.table) < len(whole.table)
    for name, values in some.table.items():
        scale = max(1.0, float(np.abs(whole[name]).max()))
        np.testing.assert_allclose(values, whole[name], rtol=0, atol=1e-11 * scale, err_msg=name)
    if contacts:
        assert some.largest_slip(0) == pytest.approx(whole.largest_slip(0))
        assert some.is_ever_on(0)


def test_terms_that_nobody_asked_for_are_computed_of_few_samples_alone(
    puma: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: dict[str, int] = {}

    def counted(name: str) -> None:
        own = getattr(Dynamics, name)

        def call(self: Any, q: Any, *others: Any) -> Any:
            seen[name] = seen.get(name, 0) + len(q)
            return own(self, q, *others)

        monkeypatch.setattr(Dynamics, name, call)

    for name in ("packed", "inverse_dynamics"):
        counted(name)
    robot = load_robot(PUMA560, "numpy")  # of few samples native's compiled calls answer themselves
    analyze(puma, robot, columns=["sums"])
    assert seen == {"packed": 8, "inverse_dynamics": 308}
    seen.clear()
    analyze(puma, robot, columns=["tau_gravity/**"])
    assert seen == {"packed": 308, "inverse_dynamics": 8}


def test_a_package_whose_terms_do_not_sum_up_is_refused_whatever_is_asked_for(
    puma: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = Dynamics.packed

    def wrong(self: Any, *motion: Any) -> Any:
        found = own(self, *motion)
        return found._replace(gravity=found.gravity * 1.001)

    monkeypatch.setattr(Dynamics, "packed", wrong)
    with pytest.raises(LinkwiseError, match="torques do not close"):
        analyze(puma, load_robot(PUMA560, "numpy"), columns=["sums"])


def test_what_was_left_out_is_refused_and_never_zero(puma: Path) -> None:
    result = analyze(puma, PUMA560, columns=["sums"])
    assert result.torque.any()
    assert result.joint_work.given.any()
    for name in ("partial_torque", "acceleration", "velocity", "gravity", "power", "work"):
        with pytest.raises(LinkwiseError, match="columns left out what this is made of"):
            getattr(result, name)
    with pytest.raises(LinkwiseError, match=r"made of \(power_link, tau_gravity, tau_link, tau_qd"):
        result.figure("shares")
    work = result.record()["work"]
    assert list(work) == ["unit", "of_joints", "against_loads"]
    html = result._repr_html_()
    assert "largest cause" not in html
    assert "peak |τ|" in html
    part = analyze(puma, PUMA560, columns=["tau_gravity/joint1/*"])
    with pytest.raises(LinkwiseError, match=r"made of \(tau_gravity\); it is there .*'causes'"):
        _ = part.gravity


def test_a_dataset_has_what_was_asked_for(puma: Path) -> None:
    pytest.importorskip("xarray")
    found = analyze(puma, PUMA560, columns=["sums"]).to_xarray()
    assert {"torque", "joint_power", "joint_work"} <= set(found)
    assert not {"partial_torque", "propagation", "power", "work"} & set(found)


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (
            "sum",
            "which takes all, sums, by-cause, causes, or columns, has 'sum', which no column is called",
        ),
        ("tau/joint9", "columns, has 'tau/joint9', which no column is called"),
        ("power_qdd/**", "columns, has 'power_qdd/\\*\\*', which no column is called"),
    ],
)
def test_what_no_column_is_called_is_refused(asked: str, message: str, puma: Path) -> None:
    with pytest.raises(LinkwiseError, match=message):
        analyze(puma, PUMA560, columns=asked)


def test_columns_that_come_beside_others_are_chosen_by_their_own_names(puma: Path, tmp_path: Path) -> None:
    (tmp_path / "bodies.toml").write_text('schema = 1\n[all]\nmass = "10 %"\n')
    asked = {"uncertain": tmp_path / "bodies.toml", "reactions": ["joint1"]}
    whole = analyze(puma, PUMA560, **asked)
    bearing = [column.name for column in whole.columns if column.name.startswith("reaction/")]
    part = analyze(puma, PUMA560, columns=["sd/tau/joint2", bearing[0]], **asked)
    names = {column.name for column in part.columns}
    assert {"tau/joint2", "sd/tau/joint2", *bearing} <= names
    assert not {"tau/joint1", "sd/tau/joint1"} & names


@pytest.mark.parametrize("asked", [[1], None, 3])
def test_what_is_no_name_of_a_column_is_refused(asked: Any, puma: Path) -> None:
    with pytest.raises(LinkwiseError, match=r"columns is .*; give words such as"):
        analyze(puma, PUMA560, columns=asked)


def test_the_table_is_narrow_and_the_page_whole(tmp_path: Path) -> None:
    log = write_csv(tmp_path / "log.csv", smooth(120, 3))
    common = ["analyze", str(log), "--robot", str(PLANAR3), "--figure", "shares"]
    for out, *more in (("all",), ("some", "--columns", "sums", "--columns", "tau/*/link2")):
        done = run_linkwise(*common, "--out", str(tmp_path / out), *more, folder=tmp_path)
        assert done.returncode == 0, done.stderr
    whole, some = tmp_path / "all", tmp_path / "some"
    for file in ("report.html", "shares.png"):
        assert (whole / file).read_bytes() == (some / file).read_bytes()
    every, table = (pq.read_table(place / "analysis.parquet") for place in (whole, some))
    assert kinds(table.column_names) == {"time/0", "q/1", "qd/1", "qdd/1", "tau/1", "tau/2", "power/1"}
    assert all(table[name].equals(every[name]) for name in table.column_names)
    record = json.loads((some / "analysis.json").read_text())
    assert [column["name"] for column in record["columns"]] == table.column_names
    assert record["asked_columns"] == ["sums", "tau/*/link2"]
    assert record["closure_is_of"] == "every sample"
    note = json.loads(table.schema.metadata[b"linkwise"])
    assert note["asked_columns"] == ["sums", "tau/*/link2"]


def test_what_other_options_ask_for_stands_in_the_table_too(tmp_path: Path) -> None:
    log = write_csv(tmp_path / "log.csv", smooth(120, 3))
    command = ["analyze", str(log), "--robot", str(PLANAR3), "--no-page", "--columns", "sums"]
    asked = ["--induced", "joints", "--power-terms", "--reaction", "joint1", "--induced-power"]
    done = run_linkwise(*command, *asked, "--out", str(tmp_path / "out"), folder=tmp_path)
    assert done.returncode == 0, done.stderr
    found = kinds(pq.read_table(tmp_path / "out/analysis.parquet").column_names)
    assert {
        "acc/2",
        "acc_qd/4",
        "power_qdd/3",
        "tau_qdd/3",
        "reaction/3",
        "flow_tau/2",
        "gain/1",
    } <= found
    assert "power/2" not in found
    assert "samples of each block" not in done.stdout


def test_the_command_says_of_which_samples_sums_close(tmp_path: Path) -> None:
    log = write_csv(tmp_path / "log.csv", smooth(120, 3))
    command = ["analyze", str(log), "--robot", str(PLANAR3), "--no-page", "--columns", "sums"]
    done = run_linkwise(*command, "--out", str(tmp_path / "out"), folder=tmp_path)
    assert "(relative), of 8 samples of each block, all terms computed there" in done.stdout


UNCERTAIN = """schema = 1
[all]
mass = "10 %"
[motion]
angle = "0.002 rad"
"""


@pytest.mark.parametrize("asked", [["sums"], ["tau_qd/**"], ["power/*/*"], ["tau_gravity/*/link3"]])
def test_deviations_stand_beside_what_is_asked_for(asked: list[str], tmp_path: Path) -> None:
    log = write_csv(tmp_path / "log.csv", smooth(40, 3))
    (tmp_path / "bodies.toml").write_text(UNCERTAIN)
    whole, some = (
        analyze(log, PLANAR3, uncertain=tmp_path / "bodies.toml", columns=columns) for columns in ([], asked)
    )
    told = {name for name in some.table if not name.startswith("sd")}
    assert {name for name in whole.table if name.partition("/")[2] in told} <= set(some.table)
    assert {name.partition("/")[2] for name in some.table if name.startswith("sd")} < told
    for name, values in some.table.items():
        np.testing.assert_allclose(values, whole[name], rtol=1e-9, atol=1e-12, err_msg=name)


def test_threads_leave_no_trace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = write_csv(tmp_path / "log.csv", smooth(4000, 6), PUMA)
    monkeypatch.setattr(stream, "worker_threads", lambda: 3)
    monkeypatch.setattr(stream, "BLOCK_BYTES", 1 << 21)
    several = analyze(log, PUMA560)
    monkeypatch.setattr(stream, "worker_threads", lambda: 1)
    one = analyze(log, PUMA560)
    assert several.robot.backend == "native"
    assert one.values.tobytes() == several.values.tobytes()
    assert one.record() == several.record()


@pytest.mark.parametrize(("told", "count"), [("1", 1), ("100000", None), ("0", 1), ("many", None)])
def test_threads_are_limited_as_those_of_other_programs(
    told: str, count: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(LIMIT, raising=False)
    usual = worker_threads()
    monkeypatch.setenv(LIMIT, told)
    assert worker_threads() == (usual if count is None else count)


def test_a_study_computes_what_its_analysis_is_asked_for(tmp_path: Path) -> None:
    chosen = HEAD + "pages = false" + READ + 'columns = ["sums"]\n' + TRIALS
    study, out = write_study(tmp_path, chosen, subjects=1, trials=1), tmp_path / "out"
    run_study(study, out, Here())
    table = pq.read_table(next(out.glob("trials/*/samples.parquet")))
    assert {"tau/1", "power/1"} <= kinds(table.column_names)
    assert not {"tau/2", "tau_qdd/3"} & kinds(table.column_names)
