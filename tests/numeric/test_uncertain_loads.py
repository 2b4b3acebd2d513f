"""Deviations of robots that bear loads, payloads and contacts, against draws of motion, bodies and loads."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from conftest import DATA
from helpers.induced_setup import write_case
from helpers.motion_logs import ROOT, smooth, write_csv
from linkwise import Load, Lowpass, Options, Payload, Processing, generate, read_system, write_package
from linkwise.analysis import Contacts, analyze
from linkwise.package.load import import_package
from linkwise_runtime.quantities import Contact

pytest.importorskip("pinocchio", reason="needs Pinocchio: pip install pin")

from numeric.drawn_bodies import DRAWS, agree
from numeric.draws import drawn_bodies, drawn_motions, load_torque, passed

GAIT10 = next(
    (ROOT / up / "shared/data/gait10" for up in (".", "..") if (ROOT / up / "shared").is_dir()), ROOT
)
"""Folder of OpenSim's Gait10dof18musc example: its subject and a walk on force plates."""
MOTION = {"rad": 5e-3, "m": 1.5e-3}
FORCE, MOMENT, POINT = 5.0, 0.5, 5e-3
FILE = """schema = 1
[motion]
angle = "5 mrad"
length = "1.5 mm"
[all]
mass = "8 %"
centre = "8 mm"
radii = "6 %"
"""
LOADS = """[loads]
force = "5 N"
moment = "0.5 N*m"
point = "5 mm"
"""
HOW = Lowpass(6.0)


class Drawn(NamedTuple):
    """A package, its model with bodies that are drawn, and motions that are drawn at a sample."""

    package: Any
    model: Any
    motion: tuple[Any, ...]

    @classmethod
    def of(cls, folder: Path, positions: Any, at: int, rate: float) -> "Drawn":
        """Draw about positions (S, n) as they are before the filter; at: the sample."""
        package = import_package(folder)
        weights = passed(len(positions), at, rate, HOW.cutoff, HOW.order)
        root = np.diag([MOTION[unit] for unit in package.load("numpy").joint_units])
        motion = drawn_motions(weights, positions, root, DRAWS)
        bodies = drawn_bodies(package, DRAWS, mass=0.08, centre=8e-3, radii=0.06)
        return cls(package, package.load("numpy", bodies=bodies), motion)

    def shares(self) -> dict[str, Any]:
        """Torques by what they are called in a result."""
        found = dict(
            zip(("tau_qdd", "tau_qd", "tau_gravity"), self.model.propagation(*self.motion), strict=True)
        )
        return found | {"tau_link": self.model.partial_torque(*self.motion)}


def off(given: Any, size: float, seed: int) -> Any:
    """Return draws (draws, 3) of a vector whose components are normal."""
    return given + size * np.random.default_rng(seed).normal(size=(DRAWS, 3))


def hold(result: Any, at: int, drawn: Mapping[str, Any]) -> None:
    """Hold the deviations of a result at a sample to those of draws."""
    for name, values in drawn.items():
        agree(result.dense(f"sd/{name}")[at], values.std(0))


def leg(folder: Path) -> tuple[Path, Path, Path]:
    """Return model, motion and loads of a leg on a plate, whose knee slides by curves."""
    write_case(folder, loads="plate.xml")
    return folder / "leg.osim", folder / "walk.sto", folder / "plate.xml"


def gait10(_: Path) -> tuple[Path, Path, Path]:
    """Return model, motion and loads of a person who walks."""
    if not (GAIT10 / "subject01.osim").is_file():
        pytest.skip("needs OpenSim's Gait10dof18musc example in shared/data/gait10")
    return tuple(
        GAIT10 / name for name in ("subject01.osim", "subject01_walk_IK.mot", "subject01_walk_grf.xml")
    )


@pytest.mark.parametrize("walker", [leg, gait10])
def test_a_walk_on_plates_deviates_as_draws_of_its_motion_its_bodies_and_its_plates(
    walker: Any, tmp_path: Path
) -> None:
    model, log, plates = walker(tmp_path)
    write_package(generate(read_system(model), ["numpy"], "walker"), tmp_path / "walker")
    (tmp_path / "all.toml").write_text(FILE + LOADS)
    raw = analyze(log, tmp_path / "walker", loads=[plates])
    result = analyze(
        log,
        tmp_path / "walker",
        processing=Processing(lowpass=HOW, start=0.4, stop=1.1),
        loads=[plates],
        uncertain=tmp_path / "all.toml",
    )
    for time in (0.65, 0.9):
        at = int(np.abs(raw.time - time).argmin())
        drawn = Drawn.of(tmp_path / "walker", raw.q, at, raw.rate)
        q, qd, _ = drawn.motion
        borne = np.stack([_pressed(drawn.model, q, load, raw.time[at]) for load in raw.loads], -1)
        whole = drawn.model.inverse_dynamics(*drawn.motion) + borne.sum(-1)
        here = int(np.abs(result.time - raw.time[at]).argmin())
        hold(result, here, drawn.shares() | {"tau_load": borne, "tau": whole, "power": whole * qd})


def _pressed(model: Any, q: Any, load: Any, time: float) -> Any:
    """Return the torques (draws, n) of a plate whose force, moment and centre of pressure are drawn."""
    (wrench,) = load.wrenches
    _, *row = (np.interp(time, wrench.table[:, 0], column) for column in wrench.table.T)
    force, about_origin, point = np.reshape(row, (3, 3))
    moment = about_origin - np.cross(point, force)
    seed = sum(map(ord, load.name))
    parts = zip((force, moment, point), (FORCE, MOMENT, POINT), strict=True)
    drawn = [off(part, size, seed + k) for k, (part, size) in enumerate(parts)]
    return load_torque(model, q, wrench.acts_on.frame.name, drawn)


@pytest.fixture(scope="module")
def crane(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    """Folder of the package of a crane on a floating base, and its log's positions."""
    folder = tmp_path_factory.mktemp("crane")
    robot = generate(read_system(str(DATA / "crane.urdf"), Options(base="floating")), ["numpy"], "crane")
    write_package(robot, folder / "crane")
    names = import_package(folder / "crane").load("numpy").joint_names
    table = smooth(160, len(names))
    table[:, 1:] *= 0.4
    write_csv(folder / "log.csv", table, names)
    (folder / "off.toml").write_text(FILE)
    (folder / "loads.toml").write_text(FILE + LOADS)
    return folder, table[:, 1:]


def analysed(folder: Path, uncertain: str = "off", **more: Any) -> Any:
    """Return the analysis of some samples about the log's sample 80."""
    how = Processing(lowpass=HOW, start=0.75, stop=0.85)
    return analyze(
        folder / "log.csv", folder / "crane", processing=how, uncertain=folder / f"{uncertain}.toml", **more
    )


HERE, AT = 80, 5
"""A sample of the log, and the same of what is analysed."""


def test_a_load_in_a_bodys_own_axes_makes_a_floating_tree_deviate_as_draws_do(
    crane: tuple[Path, Any],
) -> None:
    folder, positions = crane
    pull = Load("pull", "hook", (12.0, -7.0, 20.0), (0.4, 0.9, -0.6), (0.02, 0.05, -0.1), axes="jib")
    result = analysed(folder, "loads", loads=[pull])
    drawn = Drawn.of(folder / "crane", positions, HERE, 100.0)
    q, qd, _ = drawn.motion
    turn = drawn.model.kinematics.pose(q, "jib")[:, :3, :3]
    at = drawn.model.kinematics.pose(q, "hook")
    force, moment = (
        np.einsum("dab,db->da", turn, off(given, size, seed))
        for seed, given, size in ((21, pull.force, FORCE), (22, pull.moment, MOMENT))
    )
    point = at[:, :3, 3] + np.einsum("dab,db->da", at[:, :3, :3], off(pull.point, POINT, 23))
    borne = load_torque(drawn.model, q, "hook", (force, moment, point))
    whole = drawn.model.inverse_dynamics(*drawn.motion) + borne
    hold(result, AT, drawn.shares() | {"tau_load": borne[..., None], "tau": whole, "power": whole * qd})


def test_what_contacts_bear_and_leave_deviates_as_draws_of_the_bases_equations_do(
    crane: tuple[Path, Any],
) -> None:
    folder, positions = crane
    feet = (Contact("hook", "held"), Contact("ballast", "point", (0.1, 0.05, -0.2)))
    result = analysed(folder, contacts=Contacts(feet))
    drawn = Drawn.of(folder / "crane", positions, HERE, 100.0)
    q = drawn.motion[0]
    rows = [drawn.model.kinematics.jacobian(q, foot.frame) for foot in feet]
    arm = np.einsum(
        "dab,b->da", drawn.model.kinematics.pose(q, "ballast")[:, :3, :3], np.array(feet[1].point)
    )
    rows[1] = rows[1][:, 3:] + np.cross(rows[1][:, :3].swapaxes(1, 2), arm[:, None]).swapaxes(1, 2)
    every = np.concatenate(rows, 1)
    by_least = np.linalg.pinv(every[:, :, :6].swapaxes(1, 2))
    partial = drawn.model.partial_torque(*drawn.motion)
    forces = np.einsum("dcb,dbj->djc", by_least, partial[:, :6])
    left = partial - np.einsum("dci,djc->dij", every, forces)
    hold(result, AT, {"force_link": forces, "force": forces.sum(1)})
    for name, values in {"tau_link": left, "tau": left.sum(-1)}.items():  # the base bears nothing
        agree(result.dense(f"sd/{name}")[AT][6:], values.std(0)[6:])


def test_a_payload_is_certain_and_deviates_with_the_motion_alone(crane: tuple[Path, Any]) -> None:
    folder, positions = crane
    mass, place = 1.3, (0.04, -0.1, 0.06)
    result = analysed(folder, payloads=[Payload("hook", mass, place)])
    drawn = Drawn.of(folder / "crane", positions, HERE, 100.0)
    q = drawn.motion[0]
    gravity = read_system(str(DATA / "crane.urdf"), Options(base="floating")).robot.gravity
    moved = drawn.model.kinematics.acceleration(*drawn.motion, "hook", point=np.array(place))[:, 3:]
    pose, force = drawn.model.kinematics.pose(q, "hook"), mass * (np.array(gravity) - moved)
    at = pose[:, :3, 3] + pose[:, :3, :3] @ np.array(place)
    more = load_torque(drawn.model, q, "hook", (force, np.zeros_like(force), at))
    own = drawn.model.partial_torque(*drawn.motion)
    hold(result, AT, {"tau_link": np.concatenate([own, more[..., None]], -1), "tau": own.sum(-1) + more})
