"""Time of C for tied joints beside Pinocchio, by turns in one process, on one thread.

    python tests/benchmarks/bench_tied.py

A quadruped, Solo12, stands on the points of its four feet, and a crank turns a rocker. Of the quadruped C
answers with shares and forces of the feet by link, coordinate and order; Pinocchio with accelerations and
forces, sums alone, by constraintDynamics, and with the same numbers by its best recipe: for each link the
joints that move it, with that link's inertia alone, through crba, computeCoriolisMatrix and
computeGeneralizedGravity, and products with G and A_d+ in NumPy. C goes over rows of samples, without Python;
Pinocchio's calls go through its Python wrappers.

A step of `simulate` by RK4, with all that it answers with, is timed of these robots and of a Panda that
nothing ties, on native beside NumPy: of one motion, of 64 at once, and with a controller of Python.
Prints microseconds of a sample, and ratios.
"""

import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parent))

from conftest import PANDA
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from runtime.test_constraints import FOURBAR
from speed.rounds import by_turns
from tools.corpus import ROBOTS

SOLO = ROBOTS / "solo_description" / "robots" / "solo12.urdf"
ROWS = 64
"""Samples of a call of C."""
STEPS = {"numpy": 8, "native": 400}
"""Steps of a simulation."""
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


def motions(name: str, module: Any, start: Any, how: Callable[[Any], Any]) -> dict[str, Callable[[], Any]]:
    """Return simulations of some steps, of one motion and of many; `how` has the constraints of a robot."""
    calls = {}
    for backend, steps in STEPS.items():
        ours = module.load(backend)
        time, constraints = 1e-4 * np.arange(steps + 1), how(ours)
        kinds = {"one": (start, None)}
        if backend == "native":
            many = np.tile(start, (ROWS, 1))
            kinds |= {"at once": (many, None), "controller": (start, lambda t, q, qd: -0.01 * qd)}
        for kind, (q, tau) in kinds.items():
            calls[f"{name}, step, {backend}, {kind}"] = partial(
                ours.simulate, q, 0.0 * q, time, tau, constraints=constraints
            )
    return calls


def simulations(folders: list[Path]) -> dict[str, Callable[[], Any]]:
    """Return simulations of the quadruped, the four-bar and a Panda."""
    solo, bars = import_package(folders[0] / "robot"), import_package(folders[1] / "robot")
    panda, stance = robot(PANDA, folders[2], Options()), solo.load("numpy")
    feet = [solo.Contact(name, "point") for name in stance.kinematics.frames if name.endswith("_FOOT")]
    legs = np.concatenate([np.zeros(6), np.tile([0.1, 0.7, -1.3], 4)])
    closed = bars.load("numpy").constraints.closed_position
    return (
        motions("quadruped", solo, legs, lambda ours: ours.constrained(contacts=feet, at=legs))
        | motions("four-bar", bars, closed, lambda ours: ours.constraints)
        | motions("Panda", panda, np.full(panda.load("numpy").n, 0.2), lambda ours: None)
    )


def told_of_steps(found: dict[str, float]) -> None:
    """Print microseconds of a step of one motion, and ratios."""
    times = {}
    for name, ns in found.items():
        backend, kind = name.split(", ")[2:]
        times[name] = ns / 1e3 / STEPS[backend] / (ROWS if kind == "at once" else 1)
        print(f"{name:45} {times[name]:8.2f} µs")
    for name in ("quadruped", "four-bar", "Panda"):
        ratio = times[f"{name}, step, numpy, one"] / times[f"{name}, step, native, one"]
        print(f"{f'{name}: a step by NumPy / by native':51} {ratio:.0f}")


def main() -> None:
    """Measure, and print a line a call."""
    with tempfile.TemporaryDirectory() as work:
        folders = [Path(work, name) for name in ("quadruped", "fourbar", "panda")]
        for folder in folders:
            folder.mkdir()
        calls = quadruped(folders[0]) | fourbar(folders[1])
        found = by_turns(calls, SECONDS)
        told_of_steps(by_turns(simulations(folders), SECONDS))
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
