"""All that one run measured."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from speed.casadi_peer import CasadiPeer
from speed.emitted import TYPES, Figure
from speed.pinocchio_peer import Peer


@dataclass
class Results:
    """What goes into the table and the JSON file."""

    machine: dict[str, object]
    packages: list[dict[str, Any]] = field(default_factory=list)
    figures: list[Figure] = field(default_factory=list)
    pinocchio: dict[str, Peer] = field(default_factory=dict)
    casadi: dict[str, CasadiPeer] = field(default_factory=dict)
    limits: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def package(self, robot: str) -> dict[str, Any]:
        """Facts about one robot."""
        return next(p for p in self.packages if p["robot"] == robot)

    def find(self, robot: str, through: str, dtype: str, layout: str, threads: int = 1) -> dict[int, float]:
        """Nanoseconds by batch."""
        return {
            f.batch: f.ns
            for f in self.figures
            if (f.robot, f.through, f.dtype, f.layout, f.threads) == (robot, through, dtype, layout, threads)
        }

    def output_bytes(self, figure: Figure) -> int:
        """Bytes that one call writes."""
        return int(self.package(figure.robot)["outputs"]) * figure.batch * TYPES[figure.dtype][2]

    def bytes_written(self) -> Iterator[int]:
        """Sizes whose writing speed is wanted."""
        for figure in self.figures:
            if figure.through == "C" and figure.batch > 1:
                yield self.output_bytes(figure)

    def arithmetic_share(self, figure: Figure) -> float:
        """Share of the additions and multiplications that the machine can do in registers."""
        rate = self.package(figure.robot)["operations"] / figure.ns
        return float(rate / (self.limits["flops" + TYPES[figure.dtype][1]] * figure.threads))

    def memory_share(self, figure: Figure) -> float:
        """Share of the speed at which one thread fills an array of that size."""
        total = self.output_bytes(figure)
        return total / figure.batch / figure.ns / self.limits[f"write_{total}"]
