"""Measured seconds as data and as a page; data that are read back give the same plot again."""

import json
import math
import platform
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from linkwise.errors import LinkwiseError, within
from linkwise.escape import json_text
from linkwise.extras import extra
from linkwise.input_file import require_file
from linkwise.render import render
from linkwise.report.derivation_seconds import LIMIT, DerivationTime
from linkwise.report.reduction_curve import Study
from linkwise.report.seconds import BATCH, METHODS, Timing

DIGITS = 4
MADE_WITH = ("machine", "python", "numpy", "torch")


def seconds_json(
    robot: str, timings: Sequence[Timing], derivations: Sequence[DerivationTime]
) -> dict[str, Any]:
    """Return the measurement, and where it was made, as JSON values.

    Times are in µs for each sample, times of deriving in s.
    """
    rows = [{**asdict(t), "reduction": t.reduction} for t in timings]
    return {
        "schema": 2,
        "robot": robot,
        "unit": "microseconds a sample",
        "batch": BATCH,
        "threads": 1,
        "dtype": "float64",
        "machine": platform.machine(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "torch": extra("torch").__version__,
        "timings": [_rounded(row) for row in rows],
        "derivations": [_rounded(asdict(d)) for d in derivations],
        "derivation_limit": LIMIT,
    }


def _rounded(row: dict[str, Any]) -> dict[str, Any]:
    return {k: round(v, DIGITS) if isinstance(v, float) else v for k, v in row.items()}


def read_seconds(path: Path) -> dict[str, Any]:
    """Return an earlier measurement from a file; raise LinkwiseError for a file that is not one."""
    try:
        with within(str(path)):
            require_file(path, "cannot be read (No such file or directory); give --seconds FILE")
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        _check(found)
    except LinkwiseError:
        raise
    except OSError as error:
        raise LinkwiseError(f"{path}: cannot be read ({error.strerror}); give --seconds FILE") from error
    except (ValueError, KeyError, TypeError, AttributeError, ArithmeticError, RecursionError) as error:
        raise LinkwiseError(
            f"{path}: not a measurement; give the measured.json that --measure writes"
        ) from error
    return found


def _check(found: dict[str, Any]) -> None:
    """Raise the errors that `read_seconds` expects for a file that does not hold data of `seconds_json`."""
    json_text(found)  # raises for NaN
    methods = {timing.method for timing in timings_of(found) if math.isfinite(timing.reduction)}
    texts = all(isinstance(found[key], str) for key in ("robot", *MADE_WITH))
    derived = all(isinstance(d.dof, int) and math.isfinite(d.rule) for d in derivations_of(found))
    numbers = derived and isinstance(found["batch"], int) and math.isfinite(found["derivation_limit"])
    if not (methods <= set(METHODS) and texts and numbers):
        raise ValueError


def timings_of(found: dict[str, Any]) -> tuple[Timing, ...]:
    """Return the timings of a measurement's data."""
    return tuple(
        Timing(
            int(t["dof"]),
            str(t["method"]),
            float(t["extract"]),
            float(t["whole"]),
            float(t["everything"]),
        )
        for t in found["timings"]
    )


def derivations_of(found: dict[str, Any]) -> tuple[DerivationTime, ...]:
    """Return the derivation times in a measurement's data."""

    def seconds(value: Any) -> float | None:
        return None if value is None else float(value)

    return tuple(
        DerivationTime(int(d["dof"]), seconds(d["whole"]), seconds(d["link"]), float(d["rule"]))
        for d in found["derivations"]
    )


def seconds_markdown(result: Study, found: dict[str, Any], pictures: bool = False) -> str:
    """Return the measurement as Markdown; `pictures` shows the picture that lies beside it."""
    timings = timings_of(found)
    methods = dict.fromkeys(t.method for t in timings)
    view = {
        "pictures": pictures,
        "robot": found["robot"],
        "batch": found["batch"],
        "machine": ", ".join(f"{k} {found[k]}" for k in MADE_WITH),
        "verdicts": [_verdict(result, [t for t in timings if t.method == m]) for m in methods],
        "rows": [_line(t) for t in timings],
        "limit": f"{found['derivation_limit']:g}",
        "derivations": [_derivation(d) for d in derivations_of(found)],
    }
    return render("report/measured.md.j2", view)


def _verdict(result: Study, timings: Sequence[Timing]) -> str:
    last = timings[-1]
    terms = {p.dof: p.reduction for p in result.points}.get(last.dof)
    text = f"**{last.method.capitalize()}**: at {last.dof} DoF extracting "
    if last.reduction <= 0:
        return f"{text}saves no time: it takes {-last.reduction:.1%} more."
    text += f"saves {last.reduction:.1%} of the time"
    if terms is None:
        return text + "."
    verdict = "weaker" if last.reduction < terms else "stronger"
    return f"{text}, {verdict} than the {terms:.1%} of the terms."


def _line(t: Timing) -> tuple[str, ...]:
    times = (f"{v:.3f}" for v in (t.extract, t.whole, t.everything))
    return (str(t.dof), t.method, *times, f"{t.reduction:.3f}")


def _derivation(d: DerivationTime) -> tuple[str, ...]:
    return (str(d.dof), *("–" if t is None else f"{t:.3f}" for t in (d.whole, d.link, d.rule)))
