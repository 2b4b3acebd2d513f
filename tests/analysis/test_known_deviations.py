"""Deviations that compiled code knows against those of rows that are perturbed, as NumPy has them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import needs_compiler
from helpers.motion_logs import smooth, write_csv
from helpers.urdf_text import joint, link, robot
from linkwise import Load, Lowpass, Processing, generate, read_system, write_package
from linkwise.analysis import analyze
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.passed_noise import PassedNoise

pytestmark = needs_compiler

OWN = '<dynamics damping="0.4" friction="{friction}"/>'
SPRING = '<gazebo reference="bc"><springStiffness>4</springStiffness></gazebo>'
ROTOR = """<transmission xmlns:drake="http://drake.mit.edu"><joint name="cd"/><actuator>
<drake:rotor_inertia value="1e-4"/><drake:gear_ratio value="50"/></actuator></transmission>"""
JOINTS = ("ab", "bc", "cd")
BODIES = '[all]\nmass = "10 %"\ncentre = "10 mm"\nradii = "8 %"\n'
LENGTHS = '[all]\nlength = "3 mm"\n[body_mass]\nsd = "5 %"\n'
MOTION = '[motion]\nangle = "0.2 deg"\nlength = "1 mm"\n'
TOGETHER = '[motion.correlation]\njoints = ["ab", "cd"]\nmatrix = [[1.0, 0.6], [0.6, 1.0]]\n'
STATED = {
    "bodies": BODIES,
    "motion": MOTION,
    "both": BODIES + MOTION + TOGETHER,
    "lengths": LENGTHS + MOTION,
}


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of two arms whose joints have springs, damping and armatures, one with friction, and a log."""
    folder = tmp_path_factory.mktemp("known")
    for name, friction in (("smooth", 0.0), ("rough", 0.3)):
        own = OWN.format(friction=friction)
        text = robot(
            *map(link, "abcd"),
            joint("ab", "a", "b", inner=own),
            joint("bc", "b", "c", type="prismatic", inner=own),
            joint("cd", "c", "d", inner=own),
            SPRING,
            ROTOR,
        )
        (folder / f"{name}.urdf").write_text(text)
        system = read_system(folder / f"{name}.urdf")
        write_package(generate(system, ["numpy", "native"]), folder / name)
    write_csv(folder / "log.csv", smooth(700, 3), JOINTS)
    for name, text in STATED.items():
        (folder / f"{name}.toml").write_text(f"schema = 1\n{text}")
    return folder


def both_ways(arm: Path, robot: str, stated: str, **more: Any) -> tuple[Any, Any]:
    """Results by compiled code and by perturbed rows."""
    convention = more.pop("convention", "closing")
    processing = Processing(lowpass=Lowpass(8.0), convention=convention)
    found = (
        analyze(
            arm / "log.csv",
            load_robot(arm / robot, backend),
            processing=processing,
            uncertain=arm / f"{stated}.toml",
            **more,
        )
        for backend in ("native", "numpy")
    )
    own, other = found
    return own, other


def agree(own: Any, other: Any) -> frozenset[str]:
    """All rows agree; deviations by their squares. Returns the quantities that are there."""
    assert own.rows.places == other.rows.places
    for name in own.rows.named:
        a, b = (result.values[result.rows[name].rows] for result in (own, other))
        power = 2 if name.startswith("sd") else 1
        assert np.abs(a**power - b**power).max() <= 1e-11 * np.abs(b).max() ** power, name
    return own.rows.named


@pytest.mark.parametrize("convention", ["closing", "gradient"])
@pytest.mark.parametrize("stated", STATED)
def test_every_deviation_is_that_of_perturbed_rows(arm: Path, stated: str, convention: str) -> None:
    named = agree(*both_ways(arm, "smooth", stated, convention=convention))
    assert named >= {"sd/tau", "sd/tau_link", "sd/tau_qdd", "sd/tau_qd", "sd/power", "sd/power_link"}
    own = {"sd/tau_spring", "sd/tau_damping", "sd/tau_armature"}
    assert named >= own if stated != "bodies" else not named & own
    assert ("sd-motion/tau" in named) == (stated in ("both", "lengths"))


def test_noise_of_a_position_comes_through_a_spring_by_its_stiffness(arm: Path) -> None:
    """Without a filter, 1 mm of noise at 4 N/m."""
    found = analyze(arm / "log.csv", load_robot(arm / "smooth", "numpy"), uncertain=arm / "motion.toml")
    np.testing.assert_allclose(found["sd/tau_spring/bc"], 0.004, rtol=1e-9)


def test_noise_passes_a_filter_in_pieces_as_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def passed() -> PassedNoise:
        return PassedNoise.of(200, 100.0, Processing(lowpass=Lowpass(8.0)))

    whole = passed()
    monkeypatch.setattr("linkwise.analysis.passed_noise.AT_ONCE", 1_000)
    pieces = passed()
    for name in ("gram", "removed", "followed"):
        np.testing.assert_allclose(getattr(pieces, name), getattr(whole, name), rtol=1e-9, atol=1e-12)


def test_what_compiled_code_knows_is_not_perturbed(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "linkwise.analysis.deviation_rows.PerturbedRows", lambda *given, **more: pytest.fail("perturbed")
    )
    robot = load_robot(arm / "smooth", "native")
    found = analyze(arm / "log.csv", robot, uncertain=arm / "bodies.toml", columns=["tau_gravity/**"])
    assert found["sd/tau_gravity/ab/d"].min() > 0


@pytest.mark.parametrize("convention", ["closing", "gradient"])
def test_net_torques_have_the_deviations_of_their_convention(convention: Any, tmp_path: Path) -> None:
    """Every torque is as many times too large as the one mass of the robot."""
    massless = '<link name="b"/>'
    parts = (link("a"), massless, link("c"), joint("ab", "a", "b"), joint("bc", "b", "c"))
    (tmp_path / "arm.urdf").write_text(robot(*parts))
    (tmp_path / "mass.toml").write_text('schema = 1\n[link.c]\nmass = "10 %"\n')
    write_package(generate(read_system(tmp_path / "arm.urdf"), ["numpy"]), tmp_path / "arm")
    log, by = write_csv(tmp_path / "log.csv", smooth(60, 2), JOINTS[:2]), Processing(convention=convention)
    found = analyze(
        log, tmp_path / "arm", processing=by, columns=["by-cause"], uncertain=tmp_path / "mass.toml"
    )
    for cause in ("ab", "bc", "gravity"):
        np.testing.assert_allclose(
            found[f"sd/tau_by/ab/{cause}"], 0.1 * np.abs(found[f"tau_by/ab/{cause}"]), rtol=1e-9
        )


@pytest.mark.parametrize(
    "columns", [["tau_gravity/*/*", "power/ab"], ["tau_qdd/*/d/*", "tau_qd/cd/*/*"], ["sums"]]
)
def test_chosen_columns_have_theirs(arm: Path, columns: list[str]) -> None:
    agree(*both_ways(arm, "smooth", "both", columns=columns))


def test_joints_with_friction_and_loads_are_perturbed_beside(arm: Path) -> None:
    named = agree(*both_ways(arm, "rough", "both"))
    assert "sd/tau_friction" in named
    load = Load("weight", "d", force=(0.0, 3.0, -20.0), point=(0.1, 0.0, 0.2))
    (arm / "loaded.toml").write_text(f'schema = 1\n{STATED["both"]}[loads]\nforce = "2 N"\npoint = "5 mm"\n')
    named = agree(*both_ways(arm, "smooth", "loaded", loads=[load]))
    assert named >= {"sd/tau_load", "sd/power_load"}


def test_points_and_reactions_are_perturbed_as_before(arm: Path) -> None:
    agree(*both_ways(arm, "smooth", "motion", induced=["d"], reactions=["bc"]))
