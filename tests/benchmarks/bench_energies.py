"""Speed of links that are written in SymPy, beside SymPy's own way in the same run.

    python tests/benchmarks/bench_energies.py [--only NAME]

LagrangesMethod derives equations of motion, and lambdify(cse=True) makes a function of them: M and the
forcing. linkwise derives closed forms link by link, and native computes tau_ij of one sample by C, or of
a thousand at once. No call from Python that answers with an array is quicker than np.empty, which stands
beside. Times are the least of several rounds that take turns.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp
from linkwise import Particle, energy_system, generate, write_package
from linkwise.dynamics.derive import derive
from linkwise.package.load import import_package
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

ROUNDS = 5
MANY = 1000
T = dynamicsymbols._t


def pendulum(count: int) -> tuple[dict[Any, str], list[list[sp.Expr]]]:
    """A cart that carries a chain of pendulums: coordinates with units, and places of the masses."""
    x, *angles = dynamicsymbols(f"x q1:{count + 1}")
    places, at = [[x, sp.S.Zero]], [x, sp.S.Zero]
    for angle in angles:
        at = [at[0] + sp.sin(angle) / 2, at[1] - sp.cos(angle) / 2]
        places.append(at)
    return {x: "m", **dict.fromkeys(angles, "rad")}, places


CASES = {"cart and pendulum": 1, "cart and two": 2, "cart and three": 3, "cart and four": 4}


def least(function: Callable[[], object], seconds: float = 0.2) -> float:
    """Return the least time of a call in s."""
    best, end = float("inf"), time.perf_counter() + seconds
    while time.perf_counter() < end:
        start = time.perf_counter()
        function()
        best = min(best, time.perf_counter() - start)
    return best


def timed(function: Callable[[], Any]) -> tuple[float, Any]:
    """Return the time of one call in s, and its result."""
    start = time.perf_counter()
    found = function()
    return time.perf_counter() - start, found


def measure(name: str, count: int, folder: Path) -> str:
    """Return the row of one system."""
    coordinates, places = pendulum(count)
    names = list(coordinates)

    def by_sympy() -> Any:
        speeds = [[sp.diff(one, T) for one in place] for place in places]
        kinetic = sum((v[0] ** 2 + v[1] ** 2) / 2 for v in speeds)
        potential = sum(sp.Rational(981, 100) * place[1] for place in places)
        method = LagrangesMethod(kinetic - potential, names)
        method.form_lagranges_equations()
        return method

    def by_linkwise() -> Any:
        links = [Particle(f"m{k}", 1, place, [0, sp.Rational(-981, 100)]) for k, place in enumerate(places)]
        system = energy_system("chain", coordinates, links)
        return system, derive(system)

    derived, method = timed(by_sympy)
    own, (system, _) = timed(by_linkwise)
    rates = [q.diff(T) for q in names]
    equations = [method.mass_matrix, method.forcing]
    function = sp.lambdify([*names, *rates], [sp.Matrix(e) for e in equations], cse=True)
    write_package(generate(system, ["native"], f"chain{count}"), folder / f"chain{count}")
    robot = import_package(folder / f"chain{count}").load("native")
    rng = np.random.default_rng(0)
    q, qd, qdd = rng.normal(size=(3, len(names)))
    mass, forcing = function(*q, *qd)
    error = np.abs(robot.inverse_dynamics(q, qd, qdd) - (mass @ qdd - forcing[:, 0])).max()
    assert error < 1e-10, (name, error)
    values = [*q.tolist(), *qd.tolist()]
    robot.partial_torque(q, qd, qdd)
    many = [np.tile(a, (MANY, 1)) for a in (q, qd, qdd)]
    calls: list[Callable[[], object]] = [
        lambda: function(*values),
        lambda: robot.partial_torque(q, qd, qdd),
        lambda: np.empty((2, 2)),
        lambda: robot.partial_torque(*many),
    ]
    best = np.full(len(calls), np.inf)
    for _ in range(ROUNDS):
        best = np.minimum(best, [least(call) for call in calls])
    theirs, ours, empty, whole = best
    cells = [f"{derived:.2f}", f"{own:.2f}", f"{derived / own:.1f}"]
    cells += [f"{theirs * 1e6:.1f}", f"{ours * 1e6:.2f}", f"{theirs / ours:.0f}", f"{empty * 1e6:.2f}"]
    cells += [f"{whole / MANY * 1e9:.0f}", f"{theirs / (whole / MANY):.0f}"]
    return f"| {' | '.join([name, *cells])} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", choices=list(CASES), default=None)
    only = parser.parse_args().only
    print(
        "| system | LagrangesMethod, s | linkwise, s | ratio | lambdify, us | native, us | ratio "
        "| np.empty, us | one of a thousand, ns | ratio |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name, count in CASES.items():
            if only in (None, name):
                print(measure(name, count, Path(folder)))
                sys.stdout.flush()


if __name__ == "__main__":
    main()
