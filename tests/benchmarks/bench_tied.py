"""Time of C for tied joints beside Pinocchio, by turns in one process, on one thread.

    python tests/benchmarks/bench_tied.py

A quadruped, Solo12, stands on the points of its four feet, and a crank turns a rocker. Of the quadruped C
answers with shares and forces of the feet by link, coordinate and order; Pinocchio with accelerations and
forces, sums alone, by constraintDynamics, and with the same numbers by its best recipe: for each link the
joints that move it, with that link's inertia alone, through crba, computeCoriolisMatrix and
computeGeneralizedGravity, and products with G and A_d+ in NumPy. C goes over rows of samples, without Python;
Pinocchio's calls go through its Python wrappers.
Prints microseconds of a sample, and ratios.
"""

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parent))

from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from runtime.test_constraints import FOURBAR
from speed.rounds import by_turns
from tools.corpus import ROBOTS

SOLO = ROBOTS / "solo_description" / "robots" / "solo12.urdf"
ROWS = 64
"""Samples of a call of C."""
SECONDS = 1.0


def robot(file: Path, folder: Path, options: Options) -> Any:
    """Return a robot on the native back end."""
    made = generate(read_system(file, options), ["numpy", "native"])
    write_package(made, folder / "robot")
    return import_package(folder / "robot")


def rows(constraints: Any, call: str, *motion: Any) -> Callable[[], Any]:
    """Return a call of C over rows of one sample."""
    functions = constraints.ties.rows(constraints._robot.backend).functions
    many = [np.tile(a, (ROWS, 1)) for a in motion]
    return lambda: functions.answer(call, many)


def once(controller: Any, q: Any, qd: Any) -> Callable[[], Any]:
    """Return a controller's call of C for one sample, whose arguments are in place."""
    controller(q, qd, q)
    (of_one,) = controller._of_one.values()
    ((call,),) = of_one._of_one.free.values()
    return call.compute  # type: ignore[no-any-return]


class Alone:
    """The joints that move one link, and its inertia alone, in Pinocchio."""

    def __init__(self, model: Any, last: int) -> None:
        path = [j for j in model.supports[last] if j]
        self.model, index = pin.Model(), {0: 0}
        for j in path:
            up = index[model.parents[j]]
            index[j] = self.model.addJoint(up, model.joints[j], model.jointPlacements[j], model.names[j])
        self.model.appendBodyToJoint(index[last], model.inertias[last], pin.SE3.Identity())
        self.data, self.q = self.model.createData(), pin.neutral(self.model)
        self.v = np.ones(self.model.nv)
        self.moving = [
            k for j in path for k in range(model.joints[j].idx_v, model.joints[j].idx_v + model.joints[j].nv)
        ]

    def answers(self) -> tuple[Any, Any, Any]:
        """Return its mass matrix, Coriolis matrix and gravity torque."""
        return (
            pin.crba(self.model, self.data, self.q),
            pin.computeCoriolisMatrix(self.model, self.data, self.q, self.v),
            pin.computeGeneralizedGravity(self.model, self.data, self.q),
        )


def quadruped(folder: Path) -> dict[str, Callable[[], Any]]:
    """Return the calls for Solo12 on four feet."""
    module = robot(SOLO, folder, Options(base="floating"))
    ours = module.load("native")
    feet = [name for name in ours.kinematics.frames if name.endswith("_FOOT")]
    q, qd, qdd = np.random.default_rng(0).uniform(-0.5, 0.5, (3, ours.n))
    contacts = [module.Contact(name, kind="point") for name in feet]
    constraints = ours.constrained(contacts=contacts, at=q)
    model = pin.buildModelFromUrdf(str(SOLO), pin.JointModelFreeFlyer())
    data, place, moved = model.createData(), pin.randomConfiguration(model), np.ones(model.nv)
    held = pin.StdVec_RigidConstraintModel()
    for name in feet:
        frame = model.frames[model.getFrameId(name)]
        held.append(
            pin.RigidConstraintModel(
                pin.ContactType.CONTACT_3D, model, frame.parentJoint, frame.placement, pin.LOCAL_WORLD_ALIGNED
            )
        )
    kept = pin.StdVec_RigidConstraintData()
    for one in held:
        kept.append(one.createData())
    pin.initConstraintDynamics(model, data, held, kept)
    settings = pin.ProximalSettings(1e-12, 0.0, 1)
    alone = [Alone(model, j) for j in range(1, model.njoints)]
    trunk = module.Natural({ours.link_names[0]: 0.8})
    springs = [
        ours.partial_impedance(stiffness=3.0, constraints=constraints, **more)
        for more in ({}, {"inertia": trunk, "damping": trunk})
    ]
    follows = np.asarray(constraints.velocity_map(q))
    bears = np.linalg.pinv(np.asarray(constraints.jacobian(q))).T

    def recipe() -> None:
        for one in alone:
            one.answers()

    def projected() -> None:
        for one in alone:
            mass, coriolis, gravity = one.answers()
            mapped, left = follows[one.moving], (follows[one.moving].T, bears[:, one.moving])
            for c in (mass @ mapped, mass @ mapped + coriolis @ mapped, gravity):
                for side in left:
                    _ = side @ c

    return {
        "quadruped, C: shares": rows(constraints, "coefficients", q, qd),
        "quadruped, C: forces by cause": rows(constraints, "force_coefficients", q, qd),
        "quadruped, C: shares and forces by cause": rows(constraints, "shares_and_forces", q, qd),
        "quadruped, C: forward dynamics": rows(constraints, "forward_dynamics", q, qd, qdd),
        "quadruped, native: shares": lambda: constraints.coefficients(q, qd),
        "quadruped, one sample in C: springs": once(springs[0], q, qd),
        "quadruped, one sample in C: another inertia": once(springs[1], q, qd),
        "quadruped, native: springs": lambda: springs[0](q, qd, q),
        "quadruped, Pinocchio: rnea of the free robot": lambda: pin.rnea(model, data, place, moved, moved),
        "quadruped, Pinocchio: constraintDynamics": lambda: pin.constraintDynamics(
            model, data, place, moved, moved, held, kept, settings
        ),
        "quadruped, Pinocchio: coefficients of links": recipe,
        "quadruped, Pinocchio and NumPy: same numbers": projected,
    }


def fourbar(folder: Path) -> dict[str, Callable[[], Any]]:
    """Return the calls for a crank, a rod and a rocker."""
    file = folder / "fourbar.toml"
    file.write_text(FOURBAR)
    ours = robot(file, folder, Options()).load("native")
    constraints = ours.constraints
    q = constraints.closed_position
    qd = constraints.velocity(q, np.ones(1))
    return {
        "four-bar, C: shares": rows(constraints, "coefficients", q, qd),
        "four-bar, native: shares": lambda: constraints.coefficients(q, qd),
    }


def main() -> None:
    """Measure, and print a line a call."""
    with tempfile.TemporaryDirectory() as work:
        folders = [Path(work, name) for name in ("quadruped", "fourbar")]
        for folder in folders:
            folder.mkdir()
        calls = quadruped(folders[0]) | fourbar(folders[1])
        found = by_turns(calls, SECONDS)
    times = {name: ns / 1e3 / (ROWS if ", C:" in name else 1) for name, ns in found.items()}
    for name, time in times.items():
        print(f"{name:45} {time:8.2f} µs")
    whole, shares = times["quadruped, C: shares and forces by cause"], times["quadruped, C: shares"]
    ratios = {
        "all shares and forces by cause / constraintDynamics": whole
        / times["quadruped, Pinocchio: constraintDynamics"],
        "coefficients of links by Pinocchio / all of these": times[
            "quadruped, Pinocchio: coefficients of links"
        ]
        / whole,
        "same numbers by Pinocchio and NumPy / all of these": times[
            "quadruped, Pinocchio and NumPy: same numbers"
        ]
        / whole,
        "springs of a standing robot / rnea of the free one": times["quadruped, one sample in C: springs"]
        / times["quadruped, Pinocchio: rnea of the free robot"],
        "another inertia of a standing robot / the same": times["quadruped, one sample in C: another inertia"]
        / times["quadruped, Pinocchio: rnea of the free robot"],
        "from Python / C, quadruped": times["quadruped, native: shares"] / shares,
        "from Python / C, four-bar": times["four-bar, native: shares"] / times["four-bar, C: shares"],
    }
    for name, ratio in ratios.items():
        print(f"{name:51} {ratio:.2f}")


if __name__ == "__main__":
    main()
