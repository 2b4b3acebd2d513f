"""Constraints that a user writes in SymPy: of positions, and of velocities as where something rolls.

Oracles: LagrangesMethod and KanesMethod of SymPy, motions of textbooks, SciPy.
"""

import copy
import hashlib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import sympy as sp
import torch
from helpers.motion_logs import smooth, write_csv
from linkwise import (
    Coordinate,
    LinkEnergy,
    LinkwiseError,
    Particle,
    RigidBody,
    check_package,
    energy_system,
    from_sympy,
    generate,
    read_system,
    write_package,
)
from linkwise.analysis import analyze
from linkwise.package.load import import_package
from linkwise_runtime.constraints.chosen_constraints import best_closing
from scipy.integrate import solve_ivp
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    Point,
    ReferenceFrame,
    System,
    dynamicsymbols,
    inertia,
)
from sympy.physics.mechanics import Particle as SymPyParticle
from sympy.physics.mechanics import RigidBody as SymPyRigidBody

T = dynamicsymbols._t
x, y, yaw, lean, spin = dynamicsymbols("x y yaw lean spin")
G, R, M = 9.81, 0.5, 2.0


def loaded(system: Any, folder: Path, *backends: str) -> Any:
    write_package(generate(system, backends or ["numpy"]), folder / system.name)
    package = import_package(folder / system.name)
    return package.load(backends[0] if backends else "numpy")


def rolling_disc() -> Any:
    """A disc that touches the ground at x, y, and turns about its axis by spin as it rolls."""
    turn = sp.rot_axis3(-yaw) * sp.rot_axis1(-lean)
    centre = sp.Matrix([x, y, 0]) + R * turn * sp.Matrix([0, 0, 1])
    about = [M * R**2 / 4, M * R**2 / 2, M * R**2 / 4]
    disc = RigidBody("disc", M, list(centre), turn * sp.rot_axis2(-spin), about, gravity=[0, 0, -G])
    rolls = {
        "forwards": x.diff(T) - R * spin.diff(T) * sp.cos(yaw),
        "sideways": sp.Eq(y.diff(T), R * spin.diff(T) * sp.sin(yaw)),
    }
    units = {x: "m", y: "m", yaw: "rad", lean: "rad", spin: "rad"}
    return energy_system("disc", units, [disc], constraints=rolls)


def lagrangian(system: Any) -> sp.Expr:
    """The Lagrangian of a system in functions of time."""
    functions = {c.q: dynamicsymbols(c.name) for c in system.coordinates}
    rates = {c.qd: functions[c.q].diff(T) for c in system.coordinates}
    total = sum(link.kinetic - link.potential + sum(link.motions) for link in system.links)
    return total.xreplace(rates).xreplace(functions)


def accelerations_and_forces(
    energy: sp.Expr, coordinates: list[Any], holonomic: list[Any], rolling: list[Any], motion: Any
) -> Any:
    """Accelerations and multipliers by LagrangesMethod at q and qd, (n + C,)."""
    method = LagrangesMethod(energy, coordinates, hol_coneqs=holonomic or None, nonhol_coneqs=rolling or None)
    method.form_lagranges_equations()
    known = dict(zip([q.diff(T) for q in coordinates], motion[1], strict=True))
    known |= dict(zip(coordinates, motion[0], strict=True))
    n = len(coordinates)
    matrix, right = (part[n:, :] for part in (method.mass_matrix_full, method.forcing_full))
    values = [np.array(part.subs(known).evalf().tolist(), float) for part in (matrix[:, n:], right)]
    return np.linalg.solve(*values)[:, 0]


def states(count: int, n: int) -> Any:
    return np.random.default_rng(4).uniform(-1.0, 1.0, (2, count, n))


def test_a_disc_rolls_as_lagranges_method_says(tmp_path: Path) -> None:
    system = rolling_disc()
    robot = loaded(system, tmp_path)
    tied = robot.constraints
    assert (tied.independent, tied.rows) == (("yaw", "lean", "spin"), ("forwards", "sideways"))
    own = [2, 3, 4]
    rows = [
        x.diff(T) - R * spin.diff(T) * sp.cos(yaw),
        y.diff(T) - R * spin.diff(T) * sp.sin(yaw),
    ]
    energy = lagrangian(system)
    for q, rate in zip(*states(4, 5), strict=True):
        qd = tied.velocity(q, rate[own])
        found = tied.forward_dynamics(q, qd, np.zeros(5))
        expected = accelerations_and_forces(energy, [x, y, yaw, lean, spin], [], rows, (q, qd))
        np.testing.assert_allclose(found.qdd, expected[:5], atol=1e-12 * np.abs(expected).max())
        np.testing.assert_allclose(
            np.abs(found.forces), np.abs(expected[5:]), atol=1e-12 * np.abs(expected).max()
        )
        np.testing.assert_allclose(
            tied.inverse_dynamics(q, qd, found.qdd), 0.0, atol=1e-12 * np.abs(expected).max()
        )
        # What links need and the constraints carry, by link, sums up to the forces.
        by_link = tied.forces(q, qd, found.qdd).sum(-1)
        np.testing.assert_allclose(by_link, found.forces, atol=1e-12 * np.abs(expected).max())


def test_a_disc_rolls_as_kanes_method_says(tmp_path: Path) -> None:
    robot = loaded(rolling_disc(), tmp_path)
    ground, heading, plane, disc = (ReferenceFrame(name) for name in "NABC")
    heading.orient_axis(ground, ground.z, yaw)
    plane.orient_axis(heading, heading.x, lean)
    disc.orient_axis(plane, plane.y, spin)
    origin = Point("O")
    origin.set_vel(ground, 0)
    touching = origin.locatenew("P", x * ground.x + y * ground.y)
    touching.set_vel(ground, x.diff(T) * ground.x + y.diff(T) * ground.y)
    centre = touching.locatenew("C", R * plane.z)
    centre.set_vel(ground, centre.pos_from(origin).dt(ground))
    inertias = inertia(plane, M * R**2 / 4, M * R**2 / 2, M * R**2 / 4)
    body = SymPyRigidBody("disc", centre, disc, M, (inertias, centre))
    coordinates, speeds = [x, y, yaw, lean, spin], dynamicsymbols("u1:6")
    method = KanesMethod(
        ground,
        coordinates,
        speeds[2:],
        kd_eqs=[u - q.diff(T) for u, q in zip(speeds, coordinates, strict=True)],
        u_dependent=speeds[:2],
        velocity_constraints=[
            speeds[0] - R * speeds[4] * sp.cos(yaw),
            speeds[1] - R * speeds[4] * sp.sin(yaw),
        ],
    )
    method.kanes_equations([body], [(centre, -M * G * ground.z)])
    made = sp.lambdify([coordinates, speeds], [method.mass_matrix, method.forcing])
    order = [list(speeds).index(u) for u in method.u]
    for q, rate in zip(*states(4, 5), strict=True):
        qd = robot.constraints.velocity(q, rate[2:])
        expected = np.zeros(5)
        expected[order] = np.linalg.solve(*made(q, qd))[:, 0]
        found = robot.constraints.forward_dynamics(q, qd, np.zeros(5)).qdd
        np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("size", [1e-6, 1e6])
def test_a_constraint_may_be_written_in_any_size(size: float, tmp_path: Path) -> None:
    bob, rod = Particle("bob", M, [x, y], gravity=[0, -G]), {"rod": size * (x**2 + y**2 - 1)}
    robot = loaded(energy_system("bob", {x: "m", y: "m"}, [bob], constraints=rod, independent=[x]), tmp_path)
    np.testing.assert_allclose(robot.constraints.closed([0.6, -0.7]), [0.6, -0.8], atol=1e-9)


def test_of_positions_that_stay_open_the_one_that_is_open_least_is_told() -> None:
    left = iter([3.0, 1.0, 2.0])
    tried: Any = SimpleNamespace(
        closed_from=lambda start: SimpleNamespace(is_closed=False, open_by=next(left))
    )
    best, closed = best_closing(tried, np.zeros((3, 1)))
    assert (best.open_by, closed) == (1.0, ())


def test_where_something_rolls_positions_do_not_tell_those_of_others(tmp_path: Path) -> None:
    z = dynamicsymbols("z")
    rod, rolls = {"rod": x**2 + y**2 - 1}, {"rolls": z.diff(T) - y * x.diff(T)}
    bead = Particle("bead", M, [x, y, z])
    for number, (held, told) in enumerate(((rod, True), (rod | rolls, False))):
        made = energy_system(f"bead{number}", dict.fromkeys((x, y, z), "m"), [bead], constraints=held)
        assert loaded(made, tmp_path).constraints.ties.chosen.of_positions is told


def test_a_pendulum_in_plane_coordinates_swings_and_pulls_as_by_its_angle(tmp_path: Path) -> None:
    length = 1.5
    rod = {"rod": x**2 + y**2 - length**2}
    bob = Particle("bob", M, [x, y], gravity=[0, -G])
    robot = loaded(energy_system("bob", {x: "m", y: "m"}, [bob], constraints=rod, independent=[x]), tmp_path)
    tied, angle, rate = robot.constraints, 0.7, 0.9
    q = length * np.array([np.sin(angle), -np.cos(angle)])
    qd = length * rate * np.array([np.cos(angle), np.sin(angle)])
    np.testing.assert_allclose(tied.closed(q + 0.1 * np.eye(2)[1]), q, atol=1e-12)
    np.testing.assert_allclose(tied.closed(q[:1], start=tied.closed(q)), q, atol=1e-12)
    found = tied.forward_dynamics(q, qd, np.zeros(2))
    pull = M * (G * np.cos(angle) + length * rate**2)
    np.testing.assert_allclose(np.hypot(*(2.0 * q * found.forces)), pull, rtol=1e-12)
    motion = robot.simulate(q, qd, np.linspace(0, 2, 41), method="DOP853", rtol=1e-12, atol=1e-12)
    swing = solve_ivp(
        lambda _, s: [s[1], -G / length * np.sin(s[0])],
        (0, 2),
        [angle, rate],
        "DOP853",
        motion.time,
        rtol=1e-12,
        atol=1e-12,
    ).y[0]
    np.testing.assert_allclose(motion.q, length * np.stack([np.sin(swing), -np.cos(swing)], 1), atol=1e-9)


def test_a_knife_edge_goes_in_circles(tmp_path: Path) -> None:
    """Chaplygin's sleigh with its mass over the edge: speed and turning rate stand still."""
    body = LinkEnergy("sleigh", M * (x.diff(T) ** 2 + y.diff(T) ** 2) / 2 + yaw.diff(T) ** 2 / 2)
    edge = {"edge": -x.diff(T) * sp.sin(yaw) + y.diff(T) * sp.cos(yaw)}
    units = {x: "m", y: "m", yaw: "rad"}
    system = energy_system("sleigh", units, [body], constraints=edge, independent=["x", "yaw"])
    robot = loaded(system, tmp_path)
    speed, turning, time = 1.2, 0.6, np.linspace(0, 2.4, 25)
    motion = robot.simulate([0, 0, 0], [speed, 0, turning], time, method="DOP853", rtol=1e-12, atol=1e-12)
    radius = speed / turning
    circle = [radius * np.sin(turning * time), radius * (1 - np.cos(turning * time)), turning * time]
    np.testing.assert_allclose(motion.q, np.transpose(circle), atol=1e-9)
    # The edge pushes across, with the centripetal force.
    q, qd = motion.q[3], motion.qd[3]
    found = robot.constraints.forward_dynamics(q, qd, np.zeros(3))
    np.testing.assert_allclose(np.abs(found.forces), M * speed * turning, rtol=1e-8)
    with pytest.raises(ValueError, match="edge is a constraint of velocities, and the way matters"):
        robot.constraints.closed([0.1, 0.2])


def test_constraints_of_a_sympy_system_hold(tmp_path: Path) -> None:
    """A bead on a wire, y = a x^2, as sympy.physics.mechanics describes it."""
    system = System()
    mass, a, g = sp.symbols("m a g")
    bead = SymPyParticle("bead", system.fixed_point.locatenew("B", x * system.x + y * system.y), mass)
    bead.masscenter.set_vel(system.frame, x.diff(T) * system.x + y.diff(T) * system.y)
    system.add_bodies(bead)
    ux, uy = dynamicsymbols("ux uy")
    system.add_coordinates(x, y)
    system.add_speeds(ux, uy)
    system.add_kdes(ux - x.diff(T), uy - y.diff(T))
    system.apply_uniform_gravity(-g * system.y)
    system.add_holonomic_constraints(y - a * x**2)
    values = {mass: 0.3, a: 0.8, g: G}
    read = from_sympy(system, values, {x: "m", y: "m"}, name="wire")
    robot = loaded(read, tmp_path)
    tied = robot.constraints
    q, rate = np.array([0.4, 0.8 * 0.16]), 1.3
    qd = tied.velocity(q, [rate])
    found = tied.forward_dynamics(q, qd, np.zeros(2))
    slope = 2 * 0.8 * q[0]
    along = (-G * slope - slope * 2 * 0.8 * rate**2) / (1 + slope**2)
    np.testing.assert_allclose(found.qdd, [along, slope * along + 2 * 0.8 * rate**2], rtol=1e-12)
    expected = accelerations_and_forces(lagrangian(read), [x, y], [y - 0.8 * x**2], [], (q, qd))
    np.testing.assert_allclose(found.qdd, expected[:2], rtol=1e-12)


def wire(symbolic: bool = False) -> Any:
    """A bead on a parabola whose width is a parameter, and a weight that hangs on it over a pulley."""
    width = sp.Symbol("width", positive=True)
    units, h = {x: "m", y: "m"}, dynamicsymbols("h")
    bead = Particle("bead", 0.2, [x, y], gravity=[0, -G])
    weight = LinkEnergy("weight", 0.1 * h.diff(T) ** 2, {"hanging": 0.2 * G * h, "spring": 5 * x**2})
    holds = {"wire": y - width * x**2, "cord": x.diff(T) + h.diff(T)}
    return energy_system("wire", units | {h: "m"}, [bead, weight], {width: 0.8}, symbolic, constraints=holds)


@pytest.mark.parametrize("make", [rolling_disc, lambda: wire(symbolic=True)], ids=["disc", "wire"])
def test_check_proves_constraints_on_every_back_end(make: Any, tmp_path: Path) -> None:
    write_package(generate(make()), tmp_path / "made")
    results = check_package(tmp_path / "made")
    assert not [result for result in results if result.failed]
    told = [result.name for result in results if "closed loops" in result.name]
    assert len(told) == 6 * 4 * (2 if make is not rolling_disc else 1)


def test_constraints_move_with_parameters_and_gradients_flow_through_them(tmp_path: Path) -> None:
    system = wire(symbolic=True)
    loaded(system, tmp_path, "numpy", "torch")
    package = import_package(tmp_path / "wire")
    wide = package.load("numpy", parameters={"width": 0.1})
    q = wide.constraints.closed(np.array([0.5, 0.0, 0.0]))
    np.testing.assert_allclose(q, [0.5, 0.025, 0.0], atol=1e-12)
    tied = package.load("torch").constraints

    def forces(q: Any, rate: Any) -> Any:
        at = tied.closed(q)
        return tied.forward_dynamics(at, tied.velocity(at, rate), torch.zeros_like(q)).forces

    given = torch.tensor([0.5, 0.2, 0.1], dtype=torch.float64), torch.tensor([0.7], dtype=torch.float64)
    assert torch.autograd.gradcheck(forces, [one.requires_grad_() for one in given])


def test_other_coordinates_may_be_independent_and_a_copy_keeps_them(tmp_path: Path) -> None:
    robot = loaded(wire(), tmp_path)
    other = robot.constrained(independent=["h"], at=robot.constraints.closed([0.5, 0.2, 0.0]))
    q = other.closed(np.array([0.5, 0.2, 0.0]))
    for tied in (other, copy.copy(other)):
        assert tied.independent == ("h",)
        np.testing.assert_allclose(tied.velocity(q, [1.0]), [-1.0, -0.8, 1.0], atol=1e-12)
    named = robot.labelled("constraints.forces", q, 0 * q, 0 * q)
    assert named.sel(constraint="wire", link="weight").shape == ()


def test_what_does_not_know_constraints_says_so(tmp_path: Path) -> None:
    robot = loaded(wire(), tmp_path)
    q = np.array([0.5, 0.2, 0.0])
    with pytest.raises(ValueError, match="the joints of wire are tied"):
        robot.forward_dynamics(q, 0 * q, 0 * q)
    with pytest.raises(ValueError, match="no frame can be held"):
        robot.constrained(contacts=[import_package(tmp_path / "wire").Contact("bead")])


def test_a_wrong_row_fails(tmp_path: Path) -> None:
    write_package(generate(rolling_disc(), ["numpy"]), tmp_path / "made")
    rows, manifest = tmp_path / "made/constraints.py", tmp_path / "made/manifest.json"
    before = hashlib.sha256(rows.read_bytes()).hexdigest()
    rows.write_text(rows.read_text().replace("-0.5 * xp.cos(q3)", "-0.5001 * xp.cos(q3)"))
    after = hashlib.sha256(rows.read_bytes()).hexdigest()
    manifest.write_text(manifest.read_text().replace(before, after))
    failed = {result.name for result in check_package(tmp_path / "made") if result.failed}
    assert "numpy: velocities in closed loops against least squares" in failed


X, Y, YAW = Coordinate("x", "m"), Coordinate("y", "m"), Coordinate("yaw")
BEAD = LinkEnergy("bead", (X.qd**2 + Y.qd**2) / 2, 9.81 * Y.q)


def skate() -> Any:
    energy = LinkEnergy("skate", X.qd**2 + Y.qd**2 + YAW.qd**2 / 10, 3 * Y.q**2)
    blade = {"blade": Y.qd * sp.cos(YAW.q) - X.qd * sp.sin(YAW.q)}
    return energy_system("skate", [X, Y, YAW], [energy], constraints=blade, independent=["x", "yaw"])


def test_gradients_run_through_positions_that_constraints_of_velocities_leave(tmp_path: Path) -> None:
    robot = loaded(skate(), tmp_path, "torch")

    def end(start: Any) -> Any:
        return robot.simulate(start[:3], robot.constraints.velocity(start[:3], start[3:]), [0, 0.1, 0.2]).q[
            -1
        ]

    start = torch.tensor([0.1, 0.2, 0.3, 0.8, 0.5], dtype=torch.float64)
    closed = torch.autograd.functional.jacobian(robot.constraints.closed, start[:3])
    torch.testing.assert_close(closed, torch.eye(3, dtype=torch.float64))
    assert torch.autograd.gradcheck(end, [start.requires_grad_()])


@pytest.mark.parametrize(("backend", "method"), [("torch", "RK4"), ("numpy", "DOP853")])
def test_a_knife_edge_turns_through_all_headings(backend: str, method: str, tmp_path: Path) -> None:
    """No choice of independent coordinates holds on the way, and two motions need others at one time."""
    body = LinkEnergy("skate", X.qd**2 + Y.qd**2 + YAW.qd**2 / 10)
    blade = {"blade": Y.qd * sp.cos(YAW.q) - X.qd * sp.sin(YAW.q)}
    system = energy_system("skate", [X, Y, YAW], [body], constraints=blade, independent=["x", "yaw"])
    robot = loaded(system, tmp_path, backend)
    yaw, speed, turning = np.array([0.0, np.pi / 2]), np.array([1.2, -0.7]), np.array([1.6, -2.1])
    time = np.linspace(0, 5, 11)
    heading = yaw + turning * time[:, None]
    ways = np.sin(heading) - np.sin(yaw), np.cos(yaw) - np.cos(heading)
    circles = np.stack([*(speed / turning * way for way in ways), heading], -1)
    start = np.stack([0 * yaw, 0 * yaw, yaw], -1)
    qd = np.stack([speed * np.cos(yaw), speed * np.sin(yaw), turning], -1)
    motion = [torch.from_numpy(a) for a in (start, qd)] if backend == "torch" else [start, qd]
    exact = {"step": 0.01} if method == "RK4" else {"step": 0.1, "rtol": 1e-12, "atol": 1e-12}
    found = robot.simulate(*motion, time, method=method, **exact)
    np.testing.assert_allclose(np.asarray(found.q), circles, atol=1e-9 if method == "DOP853" else 1e-8)


def test_an_analysis_holds_a_log_to_the_constraints(tmp_path: Path) -> None:
    """A skate that goes faster along a turn, pushed along x: the blade alone moves it along y."""
    body = LinkEnergy("skate", X.qd**2 + Y.qd**2 + YAW.qd**2 / 10, {"wind": 3 * X.q + 2 * Y.q})
    blade = {"blade": Y.qd * sp.cos(YAW.q) - X.qd * sp.sin(YAW.q)}
    system = energy_system("skate", [X, Y, YAW], [body], constraints=blade, independent=["x", "yaw"])
    write_package(generate(system, ["numpy"]), tmp_path / "skate")
    time, rate, gain = np.linspace(0, 1.5, 1501), 0.7, 0.3
    speed, yaw = 1 + gain * time, rate * time
    x = speed * np.sin(yaw) / rate + gain * np.cos(yaw) / rate**2
    y = -speed * np.cos(yaw) / rate + gain * np.sin(yaw) / rate**2
    log = write_csv(tmp_path / "log.csv", np.stack([time, x, y, yaw], 1), ["x", "y", "yaw"])
    result = analyze(log, tmp_path / "skate", induced=["joints"])
    values = {column.name: row for column, row in zip(result.columns, result.values, strict=True)}
    wind = 3 + 2 * np.tan(yaw)
    np.testing.assert_allclose(values["tau_share/x/skate/wind"], wind, rtol=1e-9)
    np.testing.assert_allclose(values["tau/x"], 2 * gain / np.cos(yaw) + wind, rtol=1e-6)
    sideways = 2 * (gain * np.sin(yaw) + speed * rate * np.cos(yaw)) + 2
    np.testing.assert_allclose(values["force/blade"], sideways / np.cos(yaw), rtol=1e-6)
    whole = sum(values[name] for name in values if name.startswith("acc_") and "/joints/x/" in name)
    np.testing.assert_allclose(whole, values["acc/joints/x"], atol=1e-9)
    assert not result.warnings
    aside = write_csv(tmp_path / "aside.csv", np.stack([time, x, 0 * y, yaw], 1), ["x", "y", "yaw"])
    (told,) = analyze(aside, tmp_path / "skate").warnings
    assert "blade is not kept by the log's own velocities" in told
    late = np.stack([time + 1.5 * np.pi, x, y, yaw + 1.4], 1)
    late[:, 1:3] = np.stack([np.cos(1.4) * x - np.sin(1.4) * y, np.sin(1.4) * x + np.cos(1.4) * y], 1)
    late = late[(np.abs(late[:, 3] - np.pi / 2) > 0.01) & (late[:, 3] < np.pi / 2)]
    (told,) = analyze(write_csv(tmp_path / "late.csv", late, ["x", "y", "yaw"]), tmp_path / "skate").warnings
    assert "y move" in told
    assert "times as fast as x, yaw" in told
    short = write_csv(tmp_path / "short.csv", np.stack([time, x, yaw], 1), ["x", "yaw"])
    with pytest.raises(LinkwiseError, match="no column for joint 'y': blade is a constraint of velocities"):
        analyze(short, tmp_path / "skate")


def test_a_wire_brings_back_what_a_log_leaves_out(tmp_path: Path) -> None:
    """A bead on a wire, y = x^2, and a wheel that it turns, which hangs on coordinates that follow alone."""
    wheel = LinkEnergy("wheel", YAW.qd**2 / 5, {"spring": 3 * Y.q})
    held = {"wire": Y.q - X.q**2, "gear": YAW.q - 2 * X.q}
    system = energy_system("wire", [X, Y, YAW], [BEAD, wheel], constraints=held, independent=["x"])
    write_package(generate(system, ["numpy"]), tmp_path / "wire")
    table = smooth(60, 1)
    result = analyze(write_csv(tmp_path / "log.csv", table, ["x"]), tmp_path / "wire")
    np.testing.assert_allclose(result.q[:, 1:], np.stack([table[:, 1] ** 2, 2 * table[:, 1]], 1), atol=1e-9)
    slope, xd, xdd = 2 * result.q[:, 0], result.qd[:, 0], result.qdd[:, 0]
    bead = (1 + slope**2) * xdd + slope * 2 * xd**2 + 9.81 * slope
    np.testing.assert_allclose(result.partial_torque[:, 0, 0], bead, atol=1e-9)
    np.testing.assert_allclose(result.partial_torque[:, 0, 1], 1.6 * xdd + 3 * slope, atol=1e-9)
    off = np.column_stack([table, table[:, 1] ** 2 + 0.02])
    with pytest.raises(LinkwiseError, match=r"'y' is 0\.02 \(m or rad\) from where wire, gear close"):
        analyze(write_csv(tmp_path / "off.csv", off, ["x", "y"]), tmp_path / "wire")


def test_a_place_where_coordinates_do_not_follow_is_told_with_others_to_choose(tmp_path: Path) -> None:
    robot = loaded(skate(), tmp_path)
    with pytest.raises(ValueError, match=r"choose robot.constrained\(independent=\['y', 'yaw'\]\)"):
        robot.constraints.velocity([0, 0, np.pi / 2], [1.0, 1.0])


HELD: dict[str, Any] = {
    "far away": {"a": X.q - 1000},
    "a wide circle": {"a": X.q**2 + Y.q**2 - 50**2},
    "a far circle": {"a": (X.q - 100) ** 2 + (Y.q - 100) ** 2 - 1},
    "twice": {"a": X.q - Y.q**2, "b": 2 * (X.q - Y.q**2)},
    "with its rate": {"a": X.q - Y.q**2, "b": X.qd - 2 * Y.q * Y.qd},
    "of other sizes": {"a": 1e-6 * (X.q - Y.q**2), "b": 1e6 * (YAW.q - sp.sin(Y.q))},
    "a linear one, written otherwise": {"a": (X.qd + 1) * X.q - X.qd * X.q - Y.q},
    "a hidden zero": {"a": X.qd * Y.q - Y.qd + sp.sin(X.q) ** 2 + sp.cos(X.q) ** 2 - 1},
    "not at zero": {"a": X.qd / Y.q - Y.qd},
    'names """ of \\ all "kinds" it\'s': {'a"""b\\': X.q - Y.q, "c'd\"e": YAW.q - X.q},
}


@pytest.mark.parametrize("case", HELD)
def test_what_holds_is_taken_and_proved(case: str, tmp_path: Path) -> None:
    energy = LinkEnergy("bead", (X.qd**2 + Y.qd**2 + YAW.qd**2) / 2, 9.81 * Y.q)
    system = energy_system("held", [X, Y, YAW], [energy], constraints=HELD[case])
    write_package(generate(system, ["numpy"]), tmp_path / "held")
    tied = import_package(tmp_path / "held").load().constraints
    assert np.isfinite(tied.closed_position).all()
    assert not [result for result in check_package(tmp_path / "held") if result.failed]
    assert bool(tied.redundant) == (case in ("twice", "with its rate"))


def test_a_small_row_is_kept_as_well_as_a_large_one(tmp_path: Path) -> None:
    tiny = energy_system("tiny", [X, Y], [BEAD], constraints={"a": 1e-6 * (Y.q - X.q**2)})
    robot = loaded(tiny, tmp_path)
    with pytest.raises(ValueError, match=r"a is open by 0\.25 of its sum"):
        robot.constraints.velocity([0.5, 0.5], [1.0])


U = sp.Symbol("u")
BAD: dict[str, tuple[dict[str, Any], str]] = {
    "no dictionary": ({"constraints": [X.q]}, "`constraints` is .*; give a dictionary of expressions"),
    "no name": ({"constraints": {"": X.q}}, "a constraint is called ''; give it a name"),
    "unknown": ({"constraints": {"a": X.q + U}}, "constraint 'a': the symbol u is neither a coordinate"),
    "nothing moves it": ({"constraints": {"a": 1}}, "constraint 'a': it depends on no coordinate"),
    "a jump": ({"constraints": {"a": sp.sign(X.q)}}, "constraint 'a': it jumps where x passes zero"),
    "not linear": (
        {"constraints": {"a": X.qd**2 - Y.qd}},
        "'a': it has velocities, and is not linear",
    ),
    "not alone": ({"constraints": {"a": X.qd - Y.q}}, "constraint 'a': .* has terms without velocities"),
    "never, and small": ({"constraints": {"a": 1e-6 * (X.q**2 + Y.q**2 + 1)}}, "constraint 'a' never closes"),
    "nothing but rounding": (
        {"constraints": {"a": X.qd * (sp.sin(X.q) ** 2 + sp.cos(X.q) ** 2 - 1)}},
        "constraint 'a': no motion changes it",
    ),
    "never": ({"constraints": {"a": X.q**2 + Y.q**2 + 1}}, "constraint 'a' never closes"),
    "stands still": (
        {"constraints": {"a": X.q - Y.q, "b": X.q + Y.q - 1}},
        "the constraints 'a', 'b' leave nothing to move",
    ),
    "a square beside what is not defined everywhere": (
        {"constraints": {"a": (X.q - Y.q) ** 2 * sp.sqrt(X.q + 1)}},
        "'a' closes only where it is singular",
    ),
    "a sum of squares": (
        {"constraints": {"a": X.q**2 + Y.q**2}},
        "'a' closes only where it is singular",
    ),
    "time": (
        {"constraints": {"a": X.q - U}, "time": U},
        "constraint 'a': it depends on u, which is time; constraints that move are not modelled",
    ),
    "independent of nothing": (
        {"independent": ["x"]},
        "`independent` is for constraints, and there",
    ),
    "an unknown one": (
        {"constraints": {"a": X.q - Y.q}, "independent": ["z"]},
        "`independent` names 'z', which is no coordinate",
    ),
    "too many": (
        {"constraints": {"a": X.q - Y.q}, "independent": ["x", "y"]},
        r"2 joints are given as independent, and the constraints leave 1 to choose; choose independent=\['",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_hold_is_told(case: str) -> None:
    given, message = BAD[case]
    link = LinkEnergy("bead", X.qd**2 + Y.qd**2)
    with pytest.raises(LinkwiseError, match=message):
        generate(energy_system("bead", [X, Y], [link], **given), ["numpy"])


def test_a_file_may_define_constraints(tmp_path: Path) -> None:
    (tmp_path / "wire.py").write_text(
        "from linkwise import Coordinate, Particle\n"
        "x, y = (Coordinate(name, 'm') for name in 'xy')\n"
        "coordinates = [x, y]\n"
        "links = [Particle('bead', 1, [x.q, y.q], gravity=[0, -9.81])]\n"
        "constraints = {'wire': y.q - x.q**2}\n"
        "independent = ['x']\n"
    )
    system = read_system(tmp_path / "wire.py")
    assert system.independent == (0,)
    robot = loaded(system, tmp_path)
    assert robot.constraints.independent == ("x",)
    assert robot.constraints.names == ("wire",)


@pytest.mark.parametrize(
    ("zero", "message"),
    [
        ("y.q + z", "the symbol z is neither"),
        ("y.q**2 + 1", "never closes: .* correct its places"),
        ("y.q, 'wire': x.q", "stands twice in one dictionary"),
        ("sp.erf(y.q)", "the function erf is not supported"),
    ],
)
def test_a_constraint_of_a_file_is_named_by_its_line(zero: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "wire.py").write_text(
        "from linkwise import Coordinate, Particle\n"
        "import sympy as sp\n"
        "z = sp.Symbol('z')\n"
        "x, y = (Coordinate(name, 'm') for name in 'xy')\n"
        "coordinates, links = [x, y], [Particle('bead', 1, [x.q, y.q])]\n"
        f"constraints = {{'wire': {zero}}}\n"
    )
    with pytest.raises(LinkwiseError, match=f"wire.py: line 6: (constraint )?'wire'.*{message}"):
        read_system(tmp_path / "wire.py")


def test_independent_coordinates_of_a_file_that_are_too_many_are_named_by_their_line(tmp_path: Path) -> None:
    (tmp_path / "wire.py").write_text(
        "from linkwise import Coordinate, Particle\n"
        "x, y = (Coordinate(name, 'm') for name in 'xy')\n"
        "coordinates, links = [x, y], [Particle('bead', 1, [x.q, y.q])]\n"
        "constraints = {'wire': y.q - x.q**2}\n"
        "independent = [x, y]\n"
    )
    with pytest.raises(LinkwiseError, match=r"wire\.py: line 5: 2 joints are given as independent"):
        read_system(tmp_path / "wire.py")
