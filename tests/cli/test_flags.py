"""Flags of commands: each is what its name says, and none is another."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from linkwise import Fitting, Options
from linkwise.analysis import Lowpass, Processing, Reading
from linkwise.analysis.asked_trace import TraceChoices
from linkwise.analysis.choices import AnalysisChoices
from linkwise.analysis.phases import Phase
from linkwise.analysis.request import Outputs
from linkwise.cli.app import app
from linkwise.option import chosen, written
from linkwise.study.file import AnalysisKeys
from typer.testing import CliRunner

READING: dict[str, Any] = {
    "units": "deg",
    "time": "t",
    "topic": "/arm",
    "qpos": None,
    "map": ("a=elbow", "b=wrist"),
    "ignore_extra": True,
    "resample": 125.0,
    "loop_tolerance": 0.25,
    "derivative": "savitzky-golay",
    "window": 9,
    "degree": 3,
    "cutoff": 7.0,
    "filter_order": 4,
    "padding": "even",
}
ANALYSIS: dict[str, Any] = {
    **READING,
    "qpos": "mujoco",
    "edges": "trim",
    "convention": "gradient",
    "from_time": 0.5,
    "to_time": 1.5,
    "phase": ("stance=push",),
    "columns": ("sums", "tau/*/*"),
    "power_terms": True,
    "payload": ("hand=2",),
    "load": ("hand=1,2,3",),
    "loads": ("plate.csv",),
    "loads_cutoff": 31.0,
    "muscles": "force.sto",
    "ik_tasks": "tasks.xml",
    "plate": ("1=calcn_r",),
    "plate_threshold": 15.0,
    "c3d_axes": "+X,+Z",
    "muscle_group": ("vasti=vas_*",),
    "muscle_actuators": ("reserves.xml",),
    "contact": ("foot=held",),
    "contact_while": ("foot=on",),
    "contact_loads": ("grf.mot",),
    "contact_threshold": 42.0,
    "unactuated": ("base_x",),
    "uncertain": "bodies.toml",
    "induced": ("joints",),
    "induced_power": True,
    "reaction": ("knee,world",),
    "trace": ("knee",),
    "trace_windows": 0.2,
    "trace_weight": "borne",
    "trace_restart": ("phases",),
    "trace_torque": ("m1=knee",),
    "trace_torque_factor": 0.001,
    "induced_whole": True,
}
FLAGS = {"from_time": "--from", "to_time": "--to"}
"""Flags that are words of Python, so that keys and fields have other names."""
ROBOT = {
    "lock": ("elbow=0.5",),
    "base": "floating",
    "root": "torso",
    "tip": "hand",
    "allow_unphysical": True,
    "free_mimic": True,
    "constraints": "ties.toml",
    "independent": ("hip,knee",),
}
OPTIONS = Options(
    lock={"elbow": 0.5},
    base="floating",
    root="torso",
    tip="hand",
    allow_unphysical=True,
    free_mimic=True,
    constraints="ties.toml",
    independent=("hip,knee",),
)
SMOOTHED = Lowpass(7.0, 4, "even")
READ = Reading("deg", "t", (("a", "elbow"), ("b", "wrist")), True, 125.0, 0.25, "/arm")
WRITTEN = AnalysisChoices(
    READ,
    Processing("savitzky-golay", 9, 3, SMOOTHED, "trim", "gradient", 0.5, 1.5),
    Outputs(
        phases=(Phase("stance", "", "push", None),),
        columns=("sums", "tau/*/*"),
        power_terms=True,
        induced=("joints",),
        induced_whole=True,
        induced_power=True,
        reactions=("knee,world",),
        trace=TraceChoices(("knee",), 0.2, "borne", ("phases",), (("m1", "knee"),), 0.001),
    ),
    payload=("hand=2",),
    load=("hand=1,2,3",),
    loads=("plate.csv",),
    loads_cutoff=31.0,
    muscles="force.sto",
    ik_tasks="tasks.xml",
    plate=("1=calcn_r",),
    plate_threshold=15.0,
    c3d_axes="+X,+Z",
    muscle_group=("vasti=vas_*",),
    muscle_actuators=("reserves.xml",),
    contact=("foot=held",),
    contact_while=("foot=on",),
    contact_loads=("grf.mot",),
    contact_threshold=42.0,
    unactuated=("base_x",),
    uncertain="bodies.toml",
)


class CalledWith(Exception):
    """Ends a command where it would begin its work."""


@pytest.fixture
def called(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    """Return the arguments by which a command calls a function of its module, by the function's name."""
    monkeypatch.chdir(tmp_path)

    def call(command: str, function: str, chosen: dict[str, Any]) -> tuple[Any, ...]:
        def stop(*given: Any) -> None:
            raise CalledWith(*given)

        monkeypatch.setattr(f"linkwise.cli.{command}.{function}", stop)
        words = [command, "walk.csv", "--robot", "arm.urdf", "--out", "out"]
        for name, values in chosen.items():
            if values is None:
                continue
            flag = FLAGS.get(name, f"--{name.replace('_', '-')}")
            words += [flag] if values is True else [flag[:2] + "no-" + flag[2:]] * (values is False)
            if not isinstance(values, bool):
                several = values if isinstance(values, tuple) else (values,)
                words += [word for value in several for word in (flag, str(value))]
        ended = CliRunner().invoke(app, words).exception
        assert isinstance(ended, CalledWith), ended
        return ended.args

    return call


def test_every_flag_of_analyze_is_the_choice_of_its_name(
    called: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("linkwise.cli.analyze.opened_robot", lambda *given: "the robot")
    monkeypatch.setattr(AnalysisChoices, "payloads", lambda own, _: own)
    assert called("analyze", "with_payloads", ANALYSIS | {"qpos": None})[1] == WRITTEN
    swept = called("analyze", "with_payloads", ANALYSIS | {"qpos": None, "cutoff_sweep": "4,12"})[1]
    assert swept == replace(WRITTEN, cutoff_sweep="4,12")
    assert called("analyze", "with_payloads", {"qpos": "mujoco"})[1].reading == Reading(qpos="mujoco")


def test_keys_of_a_study_are_the_flags_of_analyze_by_name_and_default() -> None:
    usual = vars(AnalysisKeys())
    assert set(usual) == set(ANALYSIS) - {"trace_windows"}
    assert usual == {one.key: one.default for one in written(AnalysisChoices) if one.key in usual}
    assert all(usual[name] != ANALYSIS[name] for name in usual)
    assert chosen(AnalysisChoices, usual) == AnalysisChoices()
    assert chosen(AnalysisChoices, ANALYSIS | {"qpos": None}) == WRITTEN
    assert chosen(AnalysisChoices, {"qpos": "mujoco"}).reading == Reading(qpos="mujoco")


def test_choices_are_carried_out_as_they_say(monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = chosen(Outputs, {"format": "csv", "figure": ["shares"], "page": False})
    assert wanted == Outputs("csv", ("shares",), False)
    monkeypatch.setattr("linkwise.analysis.choices.chosen_contacts", lambda *given: given)
    contacts = ("foot=held",), ("foot=on",), [Path("grf.mot")], 42.0, 31.0, ("base_x",), "the robot"
    assert WRITTEN.contacts("the robot") == contacts  # type: ignore[arg-type, comparison-overlap]
    both = AnalysisChoices(loads=("plate.csv",), contact_loads=("grf.mot",), loads_cutoff=31.0)
    for files, cutoff in (
        (both, 31.0),
        (replace(both, loads=()), None),
        (replace(both, contact_loads=()), 31.0),
    ):
        assert files.borne("the robot").cutoff == cutoff  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("chosen", "wanted"),
    [
        ({}, Outputs()),
        (
            {"format": "csv", "figure": ("shares", "power"), "page": False, "power_terms": True},
            Outputs("csv", ("shares", "power"), False, power_terms=True),
        ),
    ],
    ids=["usual", "all"],
)
def test_analyze_writes_what_is_asked_for(
    called: Any, monkeypatch: pytest.MonkeyPatch, chosen: dict[str, Any], wanted: Outputs
) -> None:
    monkeypatch.setattr("linkwise.cli.analyze.opened_robot", lambda *given: "the robot")
    out, log, robot, asked, *_ = called("analyze", "analyze_to", chosen)
    assert (out, log, robot) == (Path("out"), Path("walk.csv"), "the robot")
    assert (asked.reading, asked.processing, asked.outputs) == (Reading(), Processing(), wanted)


def test_every_flag_of_a_robot_is_the_option_of_its_name(called: Any) -> None:
    robot, backend, options, _ = called("analyze", "opened_robot", {**ROBOT, "backend": "numpy"})
    assert (str(robot), backend, options) == ("arm.urdf", "numpy", OPTIONS)


def test_every_flag_of_identify_is_what_its_name_says(called: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("linkwise.cli.identify.opened_robot", lambda *given: "the robot")
    monkeypatch.setattr("linkwise.cli.identify.own_file", lambda robot: None)
    own = {
        "torque": ("c=elbow",),
        "unmeasured": ("wrist",),
        "torque_factor": 0.001,
        "friction": False,
        "unseen": 0.3,
        "uncertain": "before.toml",
    }
    log, robot, *how, _, uncertain = called("identify", "identified", READING | own)
    assert (log, robot, uncertain) == (Path("walk.csv"), "the robot", Path("before.toml"))
    fitting = Fitting((("c", "elbow"),), 0.001, False, 0.3, ("wrist",))
    assert how == [READ, Processing("savitzky-golay", 9, 3, SMOOTHED, "trim"), fitting]
    assert called("identify", "identified", {"qpos": "mujoco"})[2] == Reading(qpos="mujoco")
