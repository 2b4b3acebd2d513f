"""The emitted C, called from C."""

from dataclasses import dataclass
from pathlib import Path

from speed.package import PEERS, Package, build_flags, compiler, run

TYPES = {"float64": ("double", "", 8), "float32": ("float", "f", 4)}
MOST_BYTES = 0.6e9
"""Room for the results of one batch."""


@dataclass(frozen=True)
class Figure:
    """Nanoseconds a sample of the full decomposition."""

    robot: str
    through: str
    dtype: str
    layout: str
    batch: int
    threads: int
    ns: float


def batches(package: Package, width: int, largest: int) -> list[int]:
    """1, 1,024 and `largest`, or as many as there is room for."""
    while largest * package.outputs * width > MOST_BYTES:
        largest //= 2
    return sorted({1, 1024, largest})


def measure(package: Package, work: Path, largest: int, seconds: float) -> list[Figure]:
    """Time both layouts in both number types, alone and with two threads."""
    figures = []
    for dtype, (real, suffix, width) in TYPES.items():
        library = package.libraries[real]
        program = work / f"{package.name}_{dtype}"
        run(
            [
                compiler() or "cc", "-std=c99", *build_flags(), f"-DROBOT={package.name}",
                f"-DUPPER={package.name.upper()}", f"-DREAL={real}", f"-DSUFFIX={suffix}",
                f"-DWIDTH={suffix.upper()}", "-include", str(package.directory / "c" / f"{package.name}.h"),
                str(PEERS / "emitted.c"), str(library), f"-Wl,-rpath,{library.parent}",
                "-lpthread", "-lm", "-o", str(program),
            ]
        )  # fmt: skip
        sizes = [str(b) for b in batches(package, width, largest)]
        for line in run([str(program), str(seconds), *sizes]).splitlines():
            layout, batch, threads, ns = line.split()
            figures.append(Figure(package.name, "C", dtype, layout, int(batch), int(threads), float(ns)))
    return figures
