"""CasADi: automatic differentiation of each link's energy, cse, generated C, one sample at a time."""

import subprocess
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from speed.package import PEERS, Package, build_flags, compiler, run


@dataclass(frozen=True)
class CasadiPeer:
    """Nanoseconds a sample, operations, seconds to derive and compile, largest difference from ours."""

    ns: float
    operations: int
    derive_seconds: float
    compile_seconds: float
    difference: float
    level: str
    """Optimisation that its C was compiled with."""


def measure(package: Package, work: Path, compile_limit: float) -> CasadiPeer:
    """Derive, check, compile, time; raises RuntimeError if it isn't compiled within the seconds given."""
    import casadi as ca

    start = time.perf_counter()
    function = ca.Function("decomposition", *decomposition(package))
    derived = time.perf_counter() - start
    n = package.sizes["JOINTS"]
    motion = np.random.default_rng(1).uniform(-2, 2, (3, n))
    packed = package.module().load("numpy").packed(*motion)
    theirs = np.array(function(*motion)).ravel()
    difference = np.abs(np.concatenate(packed[:4]) - theirs).max()
    source, program = work / f"casadi_{package.name}.c", work / f"casadi_{package.name}"
    code = ca.CodeGenerator(source.name, {"casadi_int": "long long int"})
    code.add(function)
    code.generate(f"{work}/")
    start = time.perf_counter()
    flags = compiled([str(source), str(PEERS / "one.c")], program, compile_limit)
    took = time.perf_counter() - start
    operations = function.n_instructions()
    return CasadiPeer(timed(package, work), operations, derived, took, float(difference), flags)


def compiled(sources: list[str], program: Path, limit: float) -> str:
    """Compile as all peers are, or less optimised if that takes longer than the seconds given."""
    for level in ("-O3", "-O1"):
        flags = [level if flag == "-O3" else flag for flag in build_flags()]
        try:
            command = [compiler() or "cc", "-std=c99", *flags, *sources, "-lm", "-o", str(program)]
            run(command, limit=limit)
        except subprocess.TimeoutExpired:
            continue
        return level
    raise RuntimeError(f"its C was not compiled within {limit:.0f} s, neither at -O3 nor at -O1")


def again(peer: CasadiPeer, package: Package, work: Path) -> CasadiPeer:
    """The least of what was measured and of one more round."""
    return replace(peer, ns=min(peer.ns, timed(package, work)))


def timed(package: Package, work: Path) -> float:
    """Nanoseconds a sample, of the program as it was compiled."""
    program = [str(work / f"casadi_{package.name}"), str(package.sizes["JOINTS"]), str(package.outputs)]
    return float(run(program).split()[1])


def decomposition(package: Package) -> tuple[list[object], list[object]]:
    """Inputs and the packed outputs: c2, c1, g, tau."""
    import casadi as ca

    n = package.sizes["JOINTS"]
    q, qd, qdd = (ca.SX.sym(name, n) for name in ("q", "qd", "qdd"))
    c2, c1, g, tau = [], [], [], []
    for (kinetic, potential), link in zip(energies(package, q, qd), package.manifest["links"], strict=True):
        path = link["path"]
        mass = ca.hessian(kinetic, qd)[0]
        velocity = ca.jtimes(ca.gradient(kinetic, qd), q, qd) - ca.gradient(kinetic, q)
        closing = ca.jacobian(velocity, qd) / 2
        gravity = ca.gradient(potential, q)
        torque = mass @ qdd + velocity + gravity
        c2 += [mass[i, k] for a, i in enumerate(path) for k in path[a:]]
        c1 += [closing[i, k] for i in path for k in path]
        g += [gravity[i] for i in path]
        tau += [torque[i] for i in path]
    return [q, qd, qdd], ca.cse([ca.vertcat(*c2, *c1, *g, *tau)])


def energies(package: Package, q: object, qd: object) -> list[tuple[object, object]]:
    """Kinetic and potential energy of each link, from the manifest's tree."""
    import casadi as ca

    gravity = ca.DM(package.manifest["tree"]["gravity"])
    frames: list[tuple[object, ...]] = []
    found = []
    axis = ca.DM([0, 0, 1])
    for joint in package.manifest["tree"]["joints"]:
        rest = ca.DM.eye(3), ca.DM.zeros(3), ca.SX.zeros(3), ca.SX.zeros(3)
        turn, place, spin, speed = rest if joint["parent"] is None else frames[joint["parent"]]
        arm = ca.DM(joint["translation"])
        rotation = ca.sparsify(ca.DM(joint["rotation"]))
        x, xd = q[joint["coordinate"]], qd[joint["coordinate"]]
        here = place + turn @ arm
        if joint["kind"] == "revolute":
            s, c = ca.sin(x), ca.cos(x)
            about = ca.vertcat(ca.horzcat(c, -s, 0), ca.horzcat(s, c, 0), ca.horzcat(0, 0, 1))
            local = rotation @ about
            rate = local.T @ spin + axis * xd
            moved = local.T @ (speed + ca.cross(spin, arm))
        else:
            local = rotation
            here = here + turn @ rotation @ axis * x
            rate = rotation.T @ spin
            moved = rotation.T @ (speed + ca.cross(spin, arm + rotation @ axis * x)) + axis * xd
        turn = turn @ local
        frames.append((turn, here, rate, moved))
    for link in package.manifest["tree"]["links"]:
        turn, here, rate, moved = frames[link["joint"]]
        com, inertia, m = ca.DM(link["com"]), ca.DM(link["inertia"]), link["mass"]
        v = moved + ca.cross(rate, com)
        found.append(
            ((m * ca.dot(v, v) + ca.dot(rate, inertia @ rate)) / 2, -m * ca.dot(gravity, here + turn @ com))
        )
    return found
