"""The figures to reach."""

from collections.abc import Iterator
from dataclasses import dataclass

from speed.results import Results


@dataclass(frozen=True)
class Target:
    """What is measured, and the value it must not pass, from above or from below."""

    what: str
    measured: float | None
    wanted: float
    unit: str
    at_most: bool = True

    @property
    def met(self) -> bool | None:
        """Whether it is reached; None where it was not measured."""
        if self.measured is None:
            return None
        return self.measured <= self.wanted if self.at_most else self.measured >= self.wanted


def targets(results: Results) -> Iterator[Target]:
    """All of them; those of robots that were not timed have no value."""
    c64, c32 = (
        results.find("panda", "C", "float64", "blocks"),
        results.find("panda", "C", "float32", "blocks"),
    )
    two = results.find("panda", "C", "float64", "blocks", 2)
    rows = results.find("panda", "C", "float64", "rows")
    native = results.find("panda", "native", "float64", "rows")
    pin, casadi = results.pinocchio.get("panda"), results.casadi.get("panda")
    whole = pin.decomposition if pin else None
    large = max((b for b in c64 if b > 1024), default=65536)
    many = c64.get(1024)
    yield Target("Panda, float64, batch 1,024", many, 80, "ns")
    yield Target(f"Panda, float64, batch {large:,}", c64.get(large), 140, "ns")
    yield Target("Panda, float64, one sample", rows.get(1), 650, "ns")
    yield Target("Panda, float32, batch 1,024", c32.get(1024), 45, "ns")
    yield Target("Panda, float64, rows, batch 1,024", rows.get(1024), 130, "ns")
    yield Target("Panda, native from Python, one sample", scaled(native.get(1), 1e-3), 15, "µs")
    yield Target("Panda, batch, Pinocchio's full decomposition / ours", ratio(whole, many), 100, "×", False)
    yield Target(
        "Panda, one sample, Pinocchio's full decomposition / ours", ratio(whole, rows.get(1)), 20, "×", False
    )
    yield Target(
        "Panda, batch, CasADi's C / ours", ratio(casadi.ns if casadi else None, many), 15, "×", False
    )
    yield Target("Panda, batch, one rnea / ours", ratio(pin.rnea if pin else None, many), 1, "×", False)
    yield Target(
        "Panda, one sample, one rnea / ours", ratio(pin.rnea if pin else None, rows.get(1)), 1, "×", False
    )
    yield Target("Panda, two threads / one, batch 1,024", ratio(many, two.get(1024)), 1.6, "×", False)
    yield Target(
        f"Panda, two threads / one, batch {large:,}", ratio(c64.get(large), two.get(large)), 1.6, "×", False
    )
    for robot, seconds, most in (
        ("panda", 5, 4300),
        ("chain20", 30, 70000),
        ("planar3", None, 200),
        ("planar10", None, 3300),
    ):
        facts = next((p for p in results.packages if p["robot"] == robot), {})
        if seconds:
            took = facts["generate_seconds"] + facts["compile_seconds"]["double"] if facts else None
            yield Target(f"{robot}, generate and compile", took, seconds, "s")
        yield Target(f"{robot}, operations", facts.get("operations"), most, "operations")


def ratio(theirs: float | None, ours: float | None) -> float | None:
    """Their time over ours."""
    return theirs / ours if theirs and ours else None


def scaled(value: float | None, factor: float) -> float | None:
    """A value in another unit."""
    return None if value is None else value * factor
