"""Control steps of the emitted C, called from C: one sample after another."""

from pathlib import Path

from linkwise.emit.c.header import commands

from speed.emitted import Figure
from speed.package import PEERS, Package, compiler, run

CONTROL = "control of "
"""Beginnings of calls that are control steps."""


def measure(package: Package, work: Path) -> list[Figure]:
    """Nanoseconds of a step for all joints, for scaled links, and for a frame."""
    made, name = work / f"{package.name}_control", package.name
    c = package.directory / "c"
    flags = commands(name)[0].split()[1:-2]  # as the header says, for a compiler and a file
    run(
        [
            compiler() or "cc", *flags, "-D_GNU_SOURCE", f"-DROBOT={name}", f"-DUPPER={name.upper()}",
            f"-I{c}", "-include", str(c / f"{name}.h"), str(PEERS / "control.c"), str(c / f"{name}.c"),
            "-lm", "-o", str(made),
        ]
    )  # fmt: skip
    figures = []
    for line in run([str(made)]).splitlines():
        what, ns = line.split()
        figures.append(Figure(name, "C", "float64", "rows", 1, 1, float(ns), CONTROL + what))
    return figures
