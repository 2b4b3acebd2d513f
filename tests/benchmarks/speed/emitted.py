"""The emitted C, called from C."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from speed.package import PEERS, Package, build_flags, compiler, run

TYPES = {"float64": ("double", "", 8), "float32": ("float", "f", 4)}
MOST_BYTES = 0.6e9
"""Room for the results of one batch."""


@dataclass(frozen=True)
class Figure:
    """Nanoseconds a sample: of the full decomposition, or of another call."""

    robot: str
    through: str
    dtype: str
    layout: str
    batch: int
    threads: int
    ns: float
    call: str = "packed"


def least(rounds: Iterable[Sequence[Figure]]) -> list[Figure]:
    """The least of several rounds, figure by figure."""
    return [min(same, key=lambda figure: figure.ns) for same in zip(*rounds, strict=True)]


def batches(package: Package, width: int, largest: int) -> list[int]:
    """1, 256, 1,024 and `largest`, or as many as there is room for."""
    while largest * package.outputs * width > MOST_BYTES:
        largest //= 2
    return sorted({1, 256, min(1024, largest), largest})


def programs(package: Package, work: Path) -> dict[str, Path]:
    """Programs that time both layouts, by number type."""
    made = {}
    for dtype, (real, suffix, _) in TYPES.items():
        library, reactions = package.libraries[real], package.of_reactions[real]
        made[dtype] = work / f"{package.name}_{dtype}"
        run(
            [
                compiler() or "cc", "-std=c99", "-D_GNU_SOURCE", *build_flags(), f"-DROBOT={package.name}",
                f"-DUPPER={package.name.upper()}", f"-DREAL={real}", f"-DSUFFIX={suffix}",
                f"-DWIDTH={suffix.upper()}", "-include", str(package.directory / "c" / f"{package.name}.h"),
                str(PEERS / "emitted.c"), str(library), f"-Wl,-rpath,{library.parent}",
                str(reactions), f"-Wl,-rpath,{reactions.parent}",
                "-lpthread", "-lm", "-o", str(made[dtype]),
            ]
        )  # fmt: skip
    return made


def measure(package: Package, made: dict[str, Path], largest: int, seconds: float) -> list[Figure]:
    """Time both layouts, and the reactions, in both number types, alone and with two threads."""
    figures = []
    for dtype, program in made.items():
        sizes = [str(b) for b in batches(package, TYPES[dtype][2], largest)]
        for line in run([str(program), str(seconds), *sizes]).splitlines():
            call, layout, batch, threads, ns = line.split()
            figures.append(
                Figure(package.name, "C", dtype, layout, int(batch), int(threads), float(ns), call)
            )
    return figures
