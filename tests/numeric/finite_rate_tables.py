"""The tables of docs/control.md: what a loop at 1 kHz keeps of an impedance.

python tests/numeric/finite_rate_tables.py [--out out/control]
"""

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from conftest import LOCKED_FINGERS, PANDA
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package

from numeric.finite_rate import AHEAD, HELD, LOOPS, Copy, Course, JointSpace, Outcome, measured, run, studied
from numeric.impedance_fit import errors, sines_for
from numeric.measured_spaces import panda_hand, planar3_joints, spring_and_damper
from numeric.mujoco_plant import heavier, panda_model, planar_model

SECONDS = 2.0
"""Length of the record that an impedance is fitted to."""
PLANAR3_MOTION, PANDA_MOTION = 1e-4, 5e-4
"""Distance that each direction is pushed at each frequency, in rad and m."""
PLANAR3_SWING, PANDA_SWING = np.full(3, 0.5), np.full(3, 0.1)
"""Distance that the moving target goes, in rad and m."""
RATIOS = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Ratios of inertia that is asked for to the natural one."""


def table(outcomes: Sequence[Outcome], unit: str) -> str:
    """Markdown."""
    lines = [
        f"| loop | inertia | damping | stiffness | stored energy rises again | target missed by, {unit} |",
        "|---|---|---|---|---|---|",
    ]
    for row in outcomes:
        error = " | ".join(percent(e) for e in row.error)
        rise = "no" if row.rise < 1e-6 else f"by {100.0 * row.rise:.1g} %"
        missed = f"{1e3 * row.tracking:.2g}" if row.tracking >= 1e-7 else "< 0.0001"
        lines.append(f"| {row.loop.name} | {error} | {rise} | {missed} |")
    return "\n".join(lines)


def by_inertia(space: JointSpace) -> str:
    """Markdown: how far damping is off where inertia is not the natural one that `space` has."""
    lines = [
        "| inertia asked for, of the natural one | " + " | ".join(l.name for l in (HELD, AHEAD)) + " |",
        "|---|---|---|",
    ]
    for ratio in RATIOS:
        wanted = spring_and_damper(ratio * space.wanted.inertia)
        controller = space.package.load("native").partial_impedance(*wanted)
        asked = replace(space, controller=controller, wanted=wanted)
        course = Course(sines_for(wanted, PLANAR3_MOTION, SECONDS))
        records = run(asked, [Copy(loop, course) for loop in (HELD, AHEAD)], planar3_of, 2 * SECONDS)
        found = (percent(errors(measured(record, SECONDS), wanted).damping) for record in records)
        lines.append(f"| {ratio:g} | " + " | ".join(found) + " |")
    return "\n".join(lines)


def percent(share: float) -> str:
    """Return a share in percent to two digits, and no more than two behind the point."""
    return f"{round(float(f'{100.0 * share:.2g}'), 2):g} %" if share >= 1e-4 else "< 0.01 %"


def planar3_of(by: float) -> Any:
    """MuJoCo's model, each link heavier by a share."""
    return heavier(planar_model(), np.full(3, 1.0 + by))


def panda_of(by: float) -> Any:
    """Return Panda with links that are heavier by a share."""
    return heavier(panda_model(PANDA), np.full(7, 1.0 + by))


def tables(planar3: ModuleType, panda: ModuleType) -> Iterator[str]:
    """Each as it is ready."""
    asked: dict[str, tuple[Any, Callable[[float], Any], float, Any]] = {
        "planar3, its joints": (planar3_joints(planar3), planar3_of, PLANAR3_MOTION, PLANAR3_SWING),
        "Panda, its hand": (panda_hand(panda), panda_of, PANDA_MOTION, PANDA_SWING),
    }
    for title, (space, *how) in asked.items():
        outcomes: list[Outcome] = []
        for held in (False, True):
            outcomes += studied(space, [loop for loop in LOOPS if loop.held == held], *how, SECONDS)
        yield f"{title}\n\n{table(outcomes, space.unit)}\n"
    yield f"planar3, error of damping by inertia\n\n{by_inertia(planar3_joints(planar3))}\n"


def main() -> None:
    """Write finite-rate.md into the folder that --out names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/control"))
    out = parser.parse_args().out
    systems = read_system("planar3"), read_system(PANDA, Options(lock=LOCKED_FINGERS))
    parts, packages = [], []
    with tempfile.TemporaryDirectory() as folder:
        for system in systems:
            write_package(generate(system), Path(folder) / system.name)
            packages.append(import_package(Path(folder) / system.name))
        for part in tables(*packages):
            parts.append(part)
            print(part, flush=True)
    out.mkdir(parents=True, exist_ok=True)
    (out / "finite-rate.md").write_text("\n".join(parts), encoding="utf-8")
    print(f"written to {out / 'finite-rate.md'}")


if __name__ == "__main__":
    main()
