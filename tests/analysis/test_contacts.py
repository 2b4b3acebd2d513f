"""A leg that stands: what the ground bears, found from the motion, when it does, and what is refused."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.command_line import run_linkwise
from helpers.motion_logs import LEG, smooth, write_csv
from linkwise import LinkwiseError, Load, generate, read_system, write_package
from linkwise.analysis import Contact, Contacts, Processing, WhileColumn, analyze
from linkwise.analysis.show.bands import FAINT

JOINTS = ["pelvis_tx", "pelvis_ty", "pelvis_tilt", "hip_flexion_r", "knee_angle_r", "ankle_angle_r"]
MASSES = {"pelvis": 50.85, "thigh": 7.5, "shank": 3.49, "foot": 1.09}
GRAVITY = 9.80665
FOOT = Contact("foot", "held", (0.1, -0.06, 0.0), name="sole")
COUPLED = """
[[constraint]]
name = "gear"
type = "coupling"
terms = { ankle_angle_r = 1, knee_angle_r = [0.1, 0.5, 0.2] }
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A leg, one whose ankle follows the knee, and logs in which it stands still and moves."""
    made: Path = tmp_path_factory.mktemp("stance")
    write_package(generate(read_system(LEG), ["numpy"]), made / "leg")
    (made / "coupled.toml").write_text(LEG.read_text() + COUPLED)
    write_package(generate(read_system(made / "coupled.toml"), ["numpy"]), made / "coupled")
    moving = smooth(80, 6)
    moving[:, 1:] *= 0.4
    write_csv(made / "moving.csv", moving, JOINTS)
    still = moving.copy()
    still[:, 1:] = [0.0, 0.9, 0.05, 0.3, -0.4, 0.1]
    stands = (moving[:, 0] > 0.395).astype(float)
    write_csv(made / "still.csv", np.column_stack([still, stands]), [*JOINTS, "stands"])
    return made


def test_ground_bears_the_weight_of_each_link_where_all_rests(folder: Path) -> None:
    result = analyze(
        folder / "still.csv", folder / "leg", contacts=Contacts((FOOT,), {"sole": WhileColumn("stands")})
    )
    on = result.time > 0.395
    for link, mass in MASSES.items():
        bears = result[f"force/sole force_y/{link}"]
        assert np.abs(bears[on] - mass * GRAVITY).max() < 1e-9
        assert not bears[~on].any()
    # The base's joints bear the weight while nothing else does, and nothing while the ground does.
    weight = sum(MASSES.values()) * GRAVITY
    assert np.abs(result["tau/pelvis_ty"][~on] - weight).max() < 1e-9
    assert not result["tau/pelvis_ty"][on].any()


def test_a_foot_that_touches_at_a_point_leaves_a_moment_to_the_base(folder: Path) -> None:
    result = analyze(folder / "moving.csv", folder / "leg", contacts=[FOOT._replace(kind="point")])
    assert not result["force/sole force_z"].any()
    free = analyze(folder / "moving.csv", folder / "leg")
    wrench = result.contact_wrench[:, 0]
    rows = result.robot.model.kinematics.jacobian(result.q, "foot", FOOT.point)
    left = free.torque - np.einsum("srn,sr->sn", rows, wrench)
    assert np.abs(result.torque - left).max() < 1e-9 * np.abs(free.torque).max()
    assert np.abs(result.torque[:, 2]).max() > 1.0


@pytest.mark.parametrize("kind", ["pressed", "pressed-point"])
def test_a_pressed_foot_is_held_where_its_measured_load_acts(kind: str, folder: Path) -> None:
    time = np.arange(80) / 100
    place = np.stack([0.3 + 0.5 * time, -0.1 + 0.2 * time, 0.04 + 0.0 * time], 1)
    plate = Load("plate", "foot", (3.0, 700.0, 0.0), point=place, time=time, point_in="world")
    contacts = Contacts((Contact("foot", kind, (0.1, 0.0, 0.0), name="sole"),), loads=(plate,))
    result = analyze(folder / "moving.csv", folder / "leg", contacts=contacts, induced=["foot"])
    rows = ["moment_up"] * (kind == "pressed") + ["force_x", "force_y", "force_z"]
    assert list(result.rows.axes["constraint"].names) == [f"sole {row}" for row in rows]
    kinematics = result.robot.model.kinematics
    at = np.linalg.solve(kinematics.pose(result.q, "foot"), np.insert(place, 3, 1.0, axis=1)[..., None])
    jacobian = np.stack([kinematics.jacobian(q, "foot", p[:3, 0]) for q, p in zip(result.q, at, strict=True)])
    force = np.stack([result[f"force/sole force_{axis}"] for axis in "xyz"], 1)
    free = analyze(folder / "moving.csv", folder / "leg")
    left = free.torque - np.einsum("srn,sr->sn", jacobian[:, 3:], force)
    assert np.abs(result.torque - left).max() < 1e-9 * np.abs(free.torque).max()
    moment = result.contact_wrench[:, 0, :3]
    arm = place - kinematics.pose(result.q, "foot")[:, :3] @ [0.1, 0.0, 0.0, 1.0]
    assert np.abs(moment - np.cross(arm, force)).max() < 1e-9 * np.abs(free.torque).max(), "no moment there"


def test_weights_and_velocities_as_a_whole_are_the_sums_of_their_parts(folder: Path) -> None:
    log = write_csv(folder / "whole.csv", smooth(80, 5) * [1, 0.3, 0.3, 0.3, 0.3, 0.3], JOINTS[:-1])
    push = Load("push", "pelvis", (20.0, -30.0, 0.0))
    points = ["joints", "shank,0.1,0,0", "centre-of-mass"]
    each, whole = (
        analyze(log, folder / "coupled", contacts=[FOOT], loads=[push], induced=points, induced_whole=as_one)
        for as_one in (False, True)
    )
    for one, parts in (
        ("acc_weight", ["acc_gravity"]),
        ("acc_velocity", ["acc_qd", "acc_kinematic", "acc_constraint"]),
        *((name, [name]) for name in ("acc", "acc_tau", "acc_load", "acc_contact")),
    ):
        wanted = [each.dense(part).reshape(*each.dense(part).shape[:3], -1) for part in parts]
        found = whole.dense(one).reshape(*whole.dense(one).shape[:3], -1)
        if one in ("acc_weight", "acc_velocity"):
            wanted = [np.concatenate(wanted, axis=-1).sum(axis=-1, keepdims=True)]
        assert np.abs(found).max() > 0.0
        assert np.abs(found - wanted[0]).max() < 1e-10 * max(1.0, np.abs(found).max())
    assert not {"acc_qd", "acc_gravity", "acc_kinematic", "acc_constraint"} & {
        c.quantity for c in whole.columns
    }
    assert whole.closure.induced_relative is not None
    assert whole.closure.induced_relative < 1e-12
    assert "induced_velocities" in whole.to_xarray()


def test_a_pressed_foot_needs_a_load_that_presses(folder: Path) -> None:
    with pytest.raises(LinkwiseError, match="'sole' is pressed, and 0 loads are measured on its body"):
        analyze(folder / "moving.csv", folder / "leg", contacts=[FOOT._replace(kind="pressed")])


def test_the_ground_bears_of_velocities_the_same_share_in_the_gradient_convention(folder: Path) -> None:
    closing, gradient = (
        analyze(folder / "moving.csv", folder / "leg", contacts=[FOOT], processing=Processing(convention=how))
        for how in ("closing", "gradient")
    )
    velocity = closing.velocity
    assert np.abs(gradient.velocity - 2 * velocity).max() < 1e-12 * np.abs(velocity).max()


def test_forces_of_links_and_loads_sum_to_what_the_ground_bears(folder: Path) -> None:
    push = Load("push", "pelvis", (20.0, -30.0, 0.0))
    result = analyze(folder / "moving.csv", folder / "leg", contacts=[FOOT], loads=[push])
    parts = [result[f"force/sole force_x/{link}"] for link in MASSES] + [
        result["force_load/sole force_x/push"]
    ]
    assert np.abs(sum(parts) - result["force/sole force_x"]).max() < 1e-9
    assert np.abs(result["force_load/sole force_x/push"] + 20.0).max() < 1e-9
    assert np.abs(result["tau_load/ankle_angle_r/push"]).max() > 1.0  # by way of the ground
    assert result.record()["contacts"]["held"][0]["on"] == "always"


def test_measured_loads_say_when_a_foot_stands_and_load_nothing(folder: Path) -> None:
    time = np.arange(81) / 100
    force = np.stack([10.0 + 0.0 * time, 1000.0 * (time > 0.405), 0.0 * time], 1)
    plate = Load("plate", "foot", force, time=time)
    contacts = Contacts((FOOT,), loads=(plate,), threshold=50.0)
    result = analyze(folder / "moving.csv", folder / "leg", contacts=contacts)
    on = result["contact/sole"] > 0
    assert on.tolist() == (result.time > 0.40).tolist()
    assert (
        np.abs(result["force_measured/sole force_y"] - np.interp(result.time, time, force[:, 1])).max() < 1e-9
    )
    assert result.record()["contacts"]["held"][0]["on"] == {"force_above": 50.0}
    legend = result.figure("causes:ankle_angle_r").axes[0].get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["sole stands", "sole does not stand"]
    loaded = analyze(folder / "moving.csv", folder / "leg", loads=[plate])
    for joint in JOINTS:
        assert np.abs(result[f"tau_as_loads/{joint}"] - loaded[f"tau/{joint}"]).max() < 1e-9
    free = analyze(folder / "moving.csv", folder / "leg")
    assert np.abs(result.torque[~on] - free.torque[~on]).max() == 0.0


def test_a_filtered_load_says_by_its_force_as_measured_when_a_foot_stands(
    folder: Path, tmp_path: Path
) -> None:
    time = np.arange(81) / 100
    force = np.stack([0.0 * time, 1000.0 * (time > 0.405), 0.0 * time], 1)
    file = write_csv(
        tmp_path / "plate.csv", np.column_stack([time, force]), [f"foot/force_{a}" for a in "xyz"]
    )
    contacts = Contacts((FOOT,), loads=(file,), cutoff=6.0)
    result = analyze(folder / "moving.csv", folder / "leg", contacts=contacts)
    assert (result["contact/sole"] > 0).tolist() == (result.time > 0.40).tolist()
    assert 100.0 < result["force_measured/sole force_y"][41] < 900.0, "what it bears is filtered"


def test_a_tie_bears_what_the_ground_gives_to_a_joint_that_follows(folder: Path) -> None:
    log = write_csv(folder / "coupled.csv", smooth(80, 5) * [1, 0.3, 0.3, 0.3, 0.3, 0.3], JOINTS[:-1])
    result = analyze(log, folder / "coupled", contacts=[FOOT])
    assert result.robot.constrained is not None
    model: Any = result.robot.constrained.open
    needed = model.inverse_dynamics(result.q, result.qd, result.qdd)
    rows = model.kinematics.jacobian(result.q, "foot", FOOT.point)
    needed = needed - np.einsum("srn,sr->sn", rows, result.contact_wrench[:, 0])
    knee = result.q[:, 4]
    needed[:, 5] -= result["force/gear"]
    needed[:, 4] -= result["force/gear"] * (0.5 + 0.4 * knee)
    scale = np.abs(result.torque).max()
    assert np.abs(result.torque - needed).max() < 1e-9 * scale
    assert np.abs(needed[:, [0, 1, 2, 5]]).max() < 1e-9 * scale
    by_link = sum(result[f"force/gear/{link}"] for link in MASSES)
    assert np.abs(by_link - result["force/gear"]).max() < 1e-9 * scale
    panel = result.figure("contacts").axes[0]
    (drawn,) = (line for line in panel.get_lines() if line.get_label() == "found from the motion")
    np.testing.assert_allclose(drawn.get_ydata(), result["force/sole force_y"], rtol=0, atol=1e-9 * scale)


def test_bands_of_what_the_ground_bears_are_one_deviation_to_either_side(folder: Path) -> None:
    pytest.importorskip("matplotlib")
    (folder / "bodies.toml").write_text('schema = 1\n[all]\nmass = "10 %"\n')
    log = folder / "moving.csv"
    result = analyze(log, folder / "leg", contacts=[FOOT], uncertain=folder / "bodies.toml")
    figure = result.figure("contacts")
    for panel, column in ((0, "sole force_y"), (-1, None)):
        (band,) = (one for one in figure.axes[panel].patches if one.get_alpha() == FAINT)
        low, high = band.get_xy()[:-1, 1].reshape(2, -1)
        names = [f"sd/force/{column}"] if column else [f"sd/tau/{name}" for name in JOINTS[3:]]
        half = (high[::-1] - low) / 2
        assert any(np.allclose(half, result[name], rtol=1e-9, atol=1e-9) for name in names)
        assert half.max() > 0.0
    assert "Bands are one standard deviation" in figure.legends[0].get_title().get_text()


@pytest.mark.parametrize("undriven", [JOINTS[:3], (*JOINTS[:2], "knee_angle_r")], ids=["base", "knee"])
def test_losses_loads_and_measured_forces_of_a_tied_leg_each_balance(
    folder: Path, undriven: tuple[str, ...]
) -> None:
    """Ground and gear bear a share's torque on what nothing drives, and on the ankle, which follows."""
    text = (folder / "coupled.toml").read_text()
    for joint, losses in (("knee_angle_r", "damping = 20"), ("ankle_angle_r", "damping = 30")):
        text = text.replace(f'name = "{joint}"\n', f'name = "{joint}"\n{losses}\n', 1)
    (folder / "damped.toml").write_text(text)
    write_package(generate(read_system(folder / "damped.toml"), ["numpy"]), folder / "damped")
    log = write_csv(folder / "damped.csv", smooth(60, 5) * [1, 0.3, 0.3, 0.3, 0.3, 0.3], JOINTS[:-1])
    push = Load("push", "shank", (30.0, -40.0, 0.0), (0.0, 0.0, 5.0), (0.1, -0.2, 0.0))
    plate = Load("plate", "foot", (60.0, 700.0, 0.0), (0.0, 0.0, -8.0), (0.15, 0.02, 0.0))
    contacts = Contacts((FOOT,), loads=(plate,), unactuated=tuple(undriven))
    result = analyze(log, folder / "damped", contacts=contacts, loads=[push])
    assert result.robot.constrained is not None
    model: Any = result.robot.constrained.open
    rows = model.kinematics.jacobian(result.q, "foot", FOOT.point)[:, [2, 3, 4]]  # turn, x, y
    gear = np.zeros_like(result.q)
    gear[:, 5], gear[:, 4] = 1.0, 0.5 + 0.4 * result.q[:, 4]
    bears = np.swapaxes(np.concatenate([rows, gear[:, None]], axis=1), 1, 2)
    at_push = model.kinematics.jacobian(result.q, "shank", push.point)[:, [2, 3, 4]]
    asked = {
        "damping": result.qd * [0.0, 0.0, 0.0, 0.0, 20.0, 30.0],
        "load": -np.einsum("srn,r->sn", at_push, [5.0, 30.0, -40.0]),
    }
    solved = [*map(JOINTS.index, undriven), 5]
    for share, torque in asked.items():
        forces = np.linalg.solve(bears[:, solved], torque[:, solved, None])
        left = torque - (bears @ forces)[..., 0]
        behind = "/push" if share == "load" else ""
        for row, force in zip(
            ("sole moment_z", "sole force_x", "sole force_y", "gear"), forces.T[0], strict=True
        ):
            found = result[f"force_{share}/{row}{behind}"]
            assert np.abs(found - force).max() < 1e-9 * np.abs(forces).max(), (share, row)
        for i in set(range(5)).difference(solved):
            found = result.table.get(f"tau_{share}/{JOINTS[i]}{behind}", 0.0)
            assert np.abs(found - left[:, i]).max() < 1e-9 * np.abs(torque).max(), (share, i)
    slip = np.einsum("srn,sn->sr", rows, result.qd)
    for row, values in zip(("angular_z", "x", "y"), slip.T, strict=True):
        assert np.abs(result[f"slip/sole {row}"] - values).max() < 1e-12
    assert result.largest_slip(0) == pytest.approx((np.abs(slip[:, 1:]).max(), np.abs(slip[:, 0]).max()))
    poses = model.kinematics.pose(result.q, "foot")[:, :3, :3]
    arm = poses @ (np.array(plate.point) - FOOT.point)
    assert np.abs(result["force_measured/sole force_y"] - 700.0).max() < 1e-9
    moment = -8.0 + arm[:, 0] * 700.0 - arm[:, 1] * 60.0
    assert np.abs(result["force_measured/sole moment_z"] - moment).max() < 1e-9
    loaded = analyze(log, folder / "damped", loads=[push, plate])
    for joint in JOINTS[:-1]:
        assert np.abs(result[f"tau_as_loads/{joint}"] - loaded[f"tau/{joint}"]).max() < 1e-9


def test_each_source_moves_a_tied_leg_on_the_ground_as_one_system_of_equations_says(folder: Path) -> None:
    """[M −Aᵀ; A 0] [q̈_x; λ_x] = [F_x; b_x] with the rows of gear and ground, b_x of these two alone."""
    log = write_csv(folder / "coupled.csv", smooth(40, 5) * [1, 0.3, 0.3, 0.3, 0.3, 0.3], JOINTS[:-1])
    result = analyze(log, folder / "coupled", contacts=[FOOT], induced=["joints"])
    assert result.robot.constrained is not None
    model: Any = result.robot.constrained.open
    ground = model.kinematics.jacobian(result.q, "foot", FOOT.point)[:, [2, 3, 4]]
    gear = np.zeros_like(result.q)
    gear[:, 5], gear[:, 4] = 1.0, 0.5 + 0.4 * result.q[:, 4]
    rows = np.concatenate([gear[:, None], ground], axis=1)
    mass, none = model.mass_matrix(result.q), np.zeros((len(rows), 4, 4))
    system = np.block([[mass, -np.swapaxes(rows, 1, 2)], [rows, none]])
    still, rest = np.zeros((len(rows), 4)), np.zeros_like(result.q)
    turning, slipping = still.copy(), still.copy()
    turning[:, 0] = -0.4 * result.qd[:, 4] ** 2
    slipping[:, 1:] = np.einsum("srn,sn->sr", ground, result.qdd)
    sources = {
        "acc_gravity": (-model.inverse_dynamics(result.q, rest, rest), still),
        "acc_constraint": (rest, turning),
        "acc_contact": (rest, slipping),
    }
    for kind, (forces, bend) in sources.items():
        moved = np.linalg.solve(system, np.concatenate([forces, bend], axis=1)[..., None])[:, :6, 0]
        for i, joint in enumerate(JOINTS):
            names = [name for name in result.table if name.startswith(f"{kind}/joints/{joint}/")]
            found = sum(result[name] for name in names)
            assert np.abs(found - moved[:, i]).max() < 1e-8 * np.abs(moved).max(), (kind, joint)


def test_contacts_bear_alike_unless_all_are_measured(folder: Path) -> None:
    knee = Contact("shank", "point", name="knee")
    plate = Load("plate", "foot", (0.0, 600.0, 0.0))
    columns = {"knee": WhileColumn("stands")}
    result = analyze(folder / "still.csv", folder / "leg", contacts=Contacts((FOOT, knee), columns, (plate,)))
    on = result.time > 0.395
    assert (result["contact/sole"][on], result["contact/sole"][~on]) == (
        pytest.approx(0.5),
        pytest.approx(1.0),
    )
    assert result["contact/knee"][on] == pytest.approx(0.5)


def test_power_of_joints_and_of_slip_is_the_gain_of_energy(folder: Path) -> None:
    result = analyze(folder / "moving.csv", folder / "leg", contacts=[FOOT])
    slip = np.stack([result[f"slip/sole {part}"] for part in ("angular_z", "x", "y")], 1)
    fed = (slip * result.contact_wrench[:, 0, [2, 3, 4]]).sum(1)
    by_link = sum(result[f"power_contact/sole/{link}"] for link in MASSES)
    assert np.abs(by_link - fed).max() < 1e-9 * np.abs(fed).max()
    assert result.contact_work.net.sum() == pytest.approx(np.trapezoid(fed, result.time))
    free = analyze(folder / "moving.csv", folder / "leg")
    assert np.abs(result.joint_power.sum(1) + fed - free.joint_power.sum(1)).max() < 1e-9 * np.abs(fed).max()
    assert result.closure.energy_relative is not None
    assert result.closure.energy_relative < 1e-9


def test_the_command_writes_forces_and_draws_them(folder: Path, tmp_path: Path) -> None:
    arguments = ["analyze", "still.csv", "--robot", "leg", "--out", tmp_path / "out"]
    contact = ["--contact", "sole:foot=held@0.1,-0.06,0", "--contact-while", "sole=stands>0.5"]
    done = run_linkwise(*arguments, *contact, "--figure", "contacts", "--format", "csv", folder=folder)
    assert done.returncode == 0, done.stderr
    record = json.loads((tmp_path / "out" / "analysis.json").read_text())
    assert record["contacts"]["unactuated"] == JOINTS[:3]
    held = record["contacts"]["held"][0]
    assert held["point"] == [0.1, -0.06, 0.0]
    assert held["on"] == {"column": "stands", "above": 0.5}
    assert "nothing drives pelvis_tx, pelvis_ty, pelvis_tilt" in done.stdout
    assert (tmp_path / "out" / "contacts.png").stat().st_size > 10_000
    header = (tmp_path / "out" / "analysis.csv").read_text().splitlines()
    assert any("force/sole force_y/pelvis" in line for line in header[:3])


def test_a_contact_stands_by_one_column(folder: Path, tmp_path: Path) -> None:
    words = "analyze", "still.csv", "--robot", "leg", "--out", tmp_path / "out", "--contact", "sole:foot=held"
    done = run_linkwise(*words, *(("--contact-while", "sole=stands>0.5") * 2), folder=folder)
    assert done.returncode == 2
    assert done.stderr == (
        "linkwise: error: --contact-while sole=stands>0.5: sole has one already; give one for each contact\n"
    )


@pytest.mark.parametrize("said", ["sole", "sole=", "=stands", "=", ""])
def test_when_a_contact_stands_is_a_name_and_a_column(said: str, folder: Path, tmp_path: Path) -> None:
    words = "analyze", "still.csv", "--robot", "leg", "--out", tmp_path / "out", "--contact", "sole:foot=held"
    done = run_linkwise(*words, f"--contact-while={said}", folder=folder)
    told = f"linkwise: error: --contact-while {said}: write it as NAME=COLUMN>VALUE\n"
    assert (done.returncode, done.stderr) == (2, told)


BAD = {
    "foot=glued": "write it as FRAME=KIND@X,Y,Z, the kind one of held, point, hinged, rolling",
    "foot=rolling": "--contact foot=rolling: write it as FRAME=rolling,RADIUS@X,Y,Z, in m",
    "foot=rolling,-1": "contact 'foot'.radius is -1.0; what rolls has one above 0, in m",
    "toes=held": "contact on 'toes': leg has no such body; its bodies are",
    "base=held": "which stands on the ground anyway",
    "foot=held@1,2": "--contact foot=held@1,2: write it as FRAME=held@X,Y,Z, in m",
}


@pytest.mark.parametrize("contact", BAD)
def test_contacts_that_cannot_be_are_refused_in_a_line(folder: Path, contact: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = "analyze", "moving.csv", "--robot", "leg", "--out", out, "--contact", contact
    done = run_linkwise(*words, folder=folder)
    assert done.returncode == 2
    assert BAD[contact] in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not out.exists()


def test_what_does_not_go_with_contacts_is_refused(folder: Path) -> None:
    log, leg = folder / "still.csv", folder / "leg"
    shank = (Load("p", "shank", (0, 9, 0)),)
    for contacts, told in (
        (Contacts((FOOT, FOOT)), "contact 'sole' stands twice"),
        (Contacts((FOOT,), {"toe": WhileColumn("stands")}), "no such contact; they are sole"),
        (Contacts((FOOT,), {"sole": WhileColumn("on")}), "no column 'on'; the log has"),
        (Contacts((FOOT,), unactuated=("hip",)), "--unactuated hip: leg has no such joint"),
        (Contacts((FOOT,), {"sole": WhileColumn("stands")}, shank), "where no contact is"),
    ):
        with pytest.raises(LinkwiseError, match=told):
            analyze(log, leg, contacts=contacts)
    knee = Contact("shank", "point", name="knee")
    with pytest.raises(LinkwiseError, match="contact 'sole': no load of --contact-loads acts on its body"):
        analyze(folder / "moving.csv", leg, contacts=Contacts((FOOT, knee), loads=shank))
    with pytest.raises(LinkwiseError, match="goes with --contact; add it"):
        Contacts(columns={"sole": WhileColumn("stands")})
    with pytest.raises(LinkwiseError, match="--contact-threshold -1: give a force in N, 0 or more"):
        Contacts((FOOT,), loads=shank, threshold=-1.0)
    with pytest.raises(LinkwiseError, match="give a list of Contact"):
        analyze(log, leg, contacts=FOOT)
    with pytest.raises(LinkwiseError, match="'foot' is not a Contact"):
        analyze(log, leg, contacts=["foot"])  # type: ignore[list-item]


def test_contacts_of_an_arm_that_is_driven_throughout_are_refused(folder: Path, tmp_path: Path) -> None:
    write_package(generate(read_system("planar3"), ["numpy"]), tmp_path / "arm")
    log = write_csv(tmp_path / "log.csv", smooth(20, 3))
    with pytest.raises(LinkwiseError, match="does not tell what a contact bears; measure that"):
        analyze(log, tmp_path / "arm", contacts=[Contact("link3", "point")])


def test_a_wheel_rolls_on_ground_across_gravity(folder: Path) -> None:
    wheel = Contact("foot", "rolling", radius=0.05)
    result = analyze(folder / "moving.csv", folder / "leg", contacts=[wheel])
    assert result.robot.contacts is not None
    assert result.robot.contacts.contacts[0].normal == (0.0, GRAVITY, 0.0)
    (told,) = result.robot.contacts.record(result.robot.joints)["held"]
    assert (told["normal"], told["radius"]) == ([0.0, GRAVITY, 0.0], 0.05)
    down = np.cross([0.0, -0.05, 0.0], result.contact_wrench[:, 0, 3:])
    assert np.abs(result.contact_wrench[:, 0, :3] - down).max() < 1e-9 * np.abs(down).max()


def test_a_contact_that_is_never_on_is_told(folder: Path) -> None:
    contacts = Contacts((FOOT,), {"sole": WhileColumn("stands", 5.0)})
    result = analyze(folder / "still.csv", folder / "leg", contacts=contacts)
    assert "contact 'sole' is never on: 'stands' is 1 at most" in result.warnings


def test_a_foot_beside_its_plate_bears_little_and_is_no_fault(folder: Path) -> None:
    shank = Contact("shank", "point", name="knee")
    loads = Load("plate", "foot", (0.0, 600.0, 0.0)), Load("missed", "shank", (0.0, 0.0, 0.0))
    columns = {"sole": WhileColumn("stands"), "knee": WhileColumn("stands")}
    contacts = Contacts((FOOT, shank), columns, loads)
    result = analyze(folder / "still.csv", folder / "leg", contacts=contacts)
    on = result.time > 0.395
    assert result["contact/knee"][on] == pytest.approx(1e-3 / 1.001)


def test_a_base_floats_wherever_its_slides_are(folder: Path, tmp_path: Path) -> None:
    text = LEG.read_text().replace('child = "carriage"', 'child = "carriage"\nxyz = [0.3, -1.2, 0.1]')
    (tmp_path / "leg.toml").write_text(text)
    write_package(generate(read_system(tmp_path / "leg.toml"), ["numpy"]), tmp_path / "leg")
    result = analyze(folder / "moving.csv", tmp_path / "leg", contacts=[FOOT])
    assert result.robot.contacts is not None
    assert result.robot.contacts.unactuated == (0, 1, 2)
