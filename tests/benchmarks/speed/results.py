"""All that one run measured."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from speed.casadi_peer import CasadiPeer
from speed.emitted import TYPES, Figure
from speed.limits import Mix
from speed.pinocchio_peer import Peer

LARGEST_WRITTEN = 2**30
"""Bytes up to which writing is timed: that of more is as quick, and would need twice the memory."""


@dataclass
class Results:
    """Contents of the table and of the JSON file."""

    machine: dict[str, object]
    packages: list[dict[str, Any]] = field(default_factory=list)
    figures: list[Figure] = field(default_factory=list)
    pinocchio: dict[str, Peer] = field(default_factory=dict)
    casadi: dict[str, CasadiPeer] = field(default_factory=dict)
    from_python: dict[str, dict[str, float]] = field(default_factory=dict)
    """Pinocchio's calls for one sample from Python, by robot and call."""
    mix: Mix | None = None
    limits: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def package(self, robot: str) -> dict[str, Any]:
        """Facts about one robot; none if it was not timed."""
        return next((p for p in self.packages if p["robot"] == robot), {})

    def find(
        self, robot: str, through: str, dtype: str, layout: str, threads: int = 1, call: str = "packed"
    ) -> dict[int, float]:
        """Nanoseconds by batch."""
        key = (robot, through, dtype, layout, threads, call)
        return {
            f.batch: f.ns
            for f in self.figures
            if (f.robot, f.through, f.dtype, f.layout, f.threads, f.call) == key
        }

    def output_bytes(self, figure: Figure) -> int:
        """Bytes that one call writes."""
        facts = self.package(figure.robot)
        values = {"packed": facts["outputs"], "partial_torque": facts["joints"] * facts["links"]}
        dense = facts["joints"] * facts["links"] * (2 * facts["joints"] + 1)
        return int(values.get(figure.call.split()[0], dense)) * figure.batch * TYPES[figure.dtype][2]

    def sizes_written(self) -> Iterator[int]:
        """Sizes whose writing speed is wanted."""
        for figure in self.figures:
            if figure.batch > 1 and figure.through in ("C", "native"):
                yield min(self.output_bytes(figure), LARGEST_WRITTEN)

    def arithmetic(self, figure: Figure) -> float | None:
        """Nanoseconds a sample that additions and multiplications take at least, sines apart."""
        operations = self.package(figure.robot)["operations"]
        rate = self.limits["flops" + TYPES[figure.dtype][1]] * figure.threads
        return operations / rate if operations else None

    def writing(self, figure: Figure, way: str) -> float:
        """Nanoseconds a sample that writing the results takes at least, one of stream, warm and fresh."""
        total = self.output_bytes(figure)
        return total / figure.batch / self.limits[f"{way}_{min(total, LARGEST_WRITTEN)}"]

    def limit(self, figure: Figure) -> float | None:
        """Nanoseconds a sample at the lower of the two limits, arithmetic and memory."""
        arithmetic = self.arithmetic(figure)
        memory = min(self.writing(figure, "stream"), self.writing(figure, "warm"))
        return None if arithmetic is None else max(arithmetic, memory)

    def figure(self, *key: Any, **more: Any) -> Figure | None:
        """One figure by robot, through, dtype, layout, batch and threads, if it was taken."""
        robot, through, dtype, layout, batch, threads = key
        call = more.get("call", "packed")
        ns = self.find(robot, through, dtype, layout, threads, call).get(batch)
        return None if ns is None else Figure(robot, through, dtype, layout, batch, threads, ns, call)
