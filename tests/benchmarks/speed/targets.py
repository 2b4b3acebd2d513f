"""The figures to reach: each is a ratio to a peer, or to what the machine can do, taken in the same run."""

from collections.abc import Iterator
from dataclasses import dataclass

from speed.control_steps import CONTROL
from speed.results import Results


@dataclass(frozen=True)
class Target:
    """Quantity that is measured, and the value it must not pass, from above or from below."""

    what: str
    measured: float | None
    wanted: float
    at_most: bool = True

    @property
    def met(self) -> bool | None:
        """Return whether it is reached; None where it was not measured."""
        if self.measured is None:
            return None
        return self.measured <= self.wanted if self.at_most else self.measured >= self.wanted


def targets(results: Results) -> Iterator[Target]:
    """All of them; those of robots that were not timed have no value."""
    yield from in_c(results)
    yield from control(results)
    yield from operations(results)
    yield from large_batches(results)
    yield from from_python(results)
    yield from dense_batches(results)
    yield from long_chains(results)
    yield from arrays(results)


def in_c(results: Results) -> Iterator[Target]:
    """Panda in C, one sample and in the cache."""
    blocks = results.figure("panda", "C", "float64", "blocks", 1024, 1)
    one = results.find("panda", "C", "float64", "rows").get(1)
    alone, both = (results.find("panda", "C", "float64", "blocks", threads) for threads in (1, 2))
    pin, casadi = results.pinocchio.get("panda"), results.casadi.get("panda")
    whole, many = pin.decomposition if pin else None, blocks.ns if blocks else None
    least = results.arithmetic(blocks) if blocks else None
    wide = 150 if results.machine.get("vectors") == "AVX-512" else 130
    yield Target("Panda, batch 1,024 / arithmetic limit", ratio(many, least), 1.5)
    yield Target("Panda, Pinocchio's full decomposition / batch 1,024", ratio(whole, many), wide, False)
    yield Target("Panda, CasADi's C / batch 1,024", ratio(casadi.ns if casadi else None, many), 20, False)
    yield Target("Panda, Pinocchio's full decomposition / one sample", ratio(whole, one), 30, False)
    yield Target("Panda, one sample / one rnea", ratio(one, pin.rnea if pin else None), 1)
    packed, borne = (
        results.find("panda", "C", "float64", "rows", call=call) for call in ("packed", "reactions")
    )
    for batch in sorted({1, 1024, *borne}):
        yield Target(
            f"Panda, reactions / decomposition, batch {batch:,}",
            ratio(borne.get(batch), packed.get(batch)),
            1.5,
        )
    for batch in sorted(b for b in both if b >= 1024) or [1024]:
        shared = ratio(alone.get(batch), both.get(batch))
        yield Target(f"Panda, one thread / two, batch {batch:,}", shared, 1.8, False)


def control(results: Results) -> Iterator[Target]:
    """Panda's control steps in C, beside Pinocchio's sums alone."""
    pin = results.pinocchio.get("panda")
    for what, wanted in (("joints", 0.6), ("links", 1.5), ("frame", 2.5)):
        took = results.find("panda", "C", "float64", "rows", call=CONTROL + what).get(1)
        yield Target(
            f"Panda, a control step, {what} / one rnea", ratio(took, pin.rnea if pin else None), wanted
        )


def operations(results: Results) -> Iterator[Target]:
    """Additions and multiplications of closed forms: numbers that no machine changes."""
    counted = {facts["robot"]: facts["operations"] for facts in results.packages}
    for robot, most in (("panda", 4300), ("chain20_straight", 70000), ("planar3", 200), ("planar10", 3300)):
        yield Target(f"{robot}, operations", counted.get(robot), most)


def large_batches(results: Results) -> Iterator[Target]:
    """Share of the lower of the machine's two limits that Panda's largest batch reaches."""
    for dtype in ("float64", "float32"):
        for layout in ("blocks", "rows"):
            batch = max(results.find("panda", "C", dtype, layout), default=0)
            figure = results.figure("panda", "C", dtype, layout, batch, 1) if batch > 1024 else None
            limit = results.limit(figure) if figure else None
            share = ratio(limit, figure.ns if figure else None)
            what = f"Panda, {dtype}, {layout}, batch {batch or 65536:,}: share of the limit"
            yield Target(what, share, 0.6, False)


def from_python(results: Results) -> Iterator[Target]:
    """Panda, one sample, against Pinocchio's own calls from Python."""
    rnea = results.from_python.get("panda", {}).get("rnea")
    for call, wanted in (("partial_torque", 0.4), ("packed", 1), ("propagation", 1.2)):
        took = results.find("panda", "native", "float64", "rows", call=call).get(1)
        yield Target(f"Panda, native from Python, one sample, {call} / rnea", ratio(took, rnea), wanted)
        through = results.find("panda", "native ctypes", "float64", "rows", call=call).get(1)
        yield Target(f"Panda, through ctypes, one sample, {call} / rnea", ratio(through, rnea), 4)


def dense_batches(results: Results) -> Iterator[Target]:
    """Dense calls against packed ones and writing the bytes: into memory in use where there is `out`."""
    packed = results.find("panda", "C", "float64", "rows")
    for call in ("coefficients", "propagation"):
        found = results.find("panda", "native", "float64", "rows", call=call)
        for batch in sorted(b for b in found if b > 1) or [1024]:
            for name, way in ((call, "fresh"), (f"{call} out", "warm")):
                figure = results.figure("panda", "native", "float64", "rows", batch, 1, call=name)
                least = None
                if figure and batch in packed:
                    least = packed[batch] + results.writing(figure, way)
                what = f"Panda, native from Python, batch {batch:,}, {name} / packed and {way} memory"
                yield Target(what, ratio(figure.ns if figure else None, least), 1.5)


def long_chains(results: Results) -> Iterator[Target]:
    """Pinocchio's decomposition over ours: 60 joints must be as good as 20."""
    shares = {}
    for robot in ("chain20", "chain60"):
        ours = [results.find(robot, "C", "float64", layout) for layout in ("blocks", "rows")]
        in_cache = [by_batch[256] for by_batch in ours if 256 in by_batch]
        pin = results.pinocchio.get(robot)
        shares[robot] = ratio(pin.decomposition if pin else None, min(in_cache, default=None))
    yield Target("chain20, Pinocchio's full decomposition / batch 256", shares["chain20"], 60, False)
    yield Target("chain60's such ratio / chain20's", ratio(shares["chain60"], shares["chain20"]), 1, False)


def arrays(results: Results) -> Iterator[Target]:
    """The vectorised rule against closed forms, and differentiated Lagrangians against these."""
    for robot, backend, wanted in (
        ("panda", "numpy", 3),
        ("panda", "torch", 6),
        ("chain20", "numpy", 30),
        ("chain20", "torch", 50),
    ):
        forms = results.find(robot, backend, "float64", "rows").get(1)
        rule = results.find(robot, f"{backend} rule", "float64", "rows").get(1)
        yield Target(
            f"{robot}, {backend}, one sample, closed forms / rule", ratio(forms, rule), wanted, False
        )
    for batch, wanted in ((1, 1.5), (1024, 4)):
        forms = results.find("panda", "torch", "float64", "rows").get(batch)
        swept = results.find("panda", "autograd", "float64", "rows").get(batch)
        yield Target(f"Panda, batch {batch:,}, autograd / torch's closed forms", ratio(swept, forms), wanted)


def ratio(a: float | None, b: float | None) -> float | None:
    """One time over another, if both were taken."""
    return a / b if a and b else None
