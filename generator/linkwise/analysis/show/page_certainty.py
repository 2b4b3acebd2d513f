"""Certainty of a page's numbers in words: a sentence, shares without a certain sign, and what was assumed."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from linkwise.analysis.certain_signs import DEVIATIONS, LargestTorque, plus_minus
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.bands import SUMMED
from linkwise.escape import printable

BODIES = {
    "mass": ("Masses", 100.0, "%"),
    "centre": ("Centres of mass", 1000.0, "mm"),
    "radii": ("Radii of gyration", 100.0, "%"),
    "length": ("Places of joints", 1000.0, "mm"),
}
"""Words for what is uncertain of each link or joint, and how a number is told."""
LOADS = {
    "force": ("Forces of loads", 1.0, "N"),
    "moment": ("Free moments of loads", 1.0, "N·m"),
    "point": ("Points of loads", 1000.0, "mm"),
}
TOLD = ("file", "links", "joints", "body_mass", "segments", "correlation", "motion", "loads", "certain")
"""Parts of the record that have words of their own."""


def certainty_data(result: AnalysisResult) -> dict[str, Any] | None:
    """Return what the page says, in texts made printable; None where nothing is uncertain."""
    if result.uncertain is None:
        return None
    signs = result.signs
    return {
        "sentence": printable(signs.sentence),
        "from": DEVIATIONS,
        "summed": SUMMED,
        "shares": len(signs.shares),
        "unsure": [_share(result, peak) for peak in signs.uncertain],
        "assumed": [printable(line) for line in assumptions(result.uncertain)],
    }


def _share(result: AnalysisResult, peak: LargestTorque) -> dict[str, Any]:
    """Return a share in words, with its largest value and the time of it."""
    column, robot = peak.column, result.robot
    kind = {"tau_qd": "velocity of ", "tau_qdd": "acceleration of "}.get(column.quantity, "gravity")
    cause = "" if column.cause is None else robot.figure_joints[column.cause]
    assert column.joint is not None
    assert column.link is not None
    return {
        "cause": printable(kind + cause),
        "joint": printable(robot.named_apart(robot.figure_joints[column.joint], column.joint)),
        "link": printable(robot.plot_links[column.link]),
        "value": f"{plus_minus(peak.value, peak.deviation)} {column.unit}",
        "time": peak.time,
    }


def assumptions(record: Mapping[str, Any]) -> Iterator[str]:
    """Yield what an analysis assumed to be how uncertain, from its record, a line each."""
    for key, (what, factor, unit) in (*BODIES.items(), *LOADS.items()):
        every = [*record.get("links", ()), *record.get("joints", ()), *record.get("loads", ())]
        told = {one["name"]: _size(one[key], factor, unit) for one in every if key in one}
        if told:
            yield f"{what}: {_most(told)}."
    if record.get("body_mass"):
        links = ", ".join(record["segments"])
        yield f"Mass of the body: ± {100 * record['body_mass']:.4g} %, with fixed parts: {links}."
    if record.get("correlation") is not None:
        yield "Errors of masses go together as the file says."
    if record.get("motion"):
        yield _of_motion(record["motion"])
    for key, value in record.items():
        if key not in TOLD and value:
            yield f"{key.replace('_', ' ').capitalize()}: {_plain(value)}."
    if record.get("certain"):
        yield f"Counted as certain: {record['certain']}."


def _of_motion(record: Mapping[str, Any]) -> str:
    """Return the noise of positions, in a line."""
    told = {one["joint"]: f"± {1000.0 * one['sd']:.3g} m{one['unit']}" for one in record["noise"]}
    matrix = record["correlation"]
    most = max((abs(x) for i, row in enumerate(matrix) for x in row[:i]), default=0.0)
    whence = ", from what the filter took away" if record["estimated_from_what_the_filter_took_away"] else ""
    together = f"; noise of joints goes together, by correlations up to {most:.2f}" if most else ""
    return f"Noise of positions{whence}: {_most(told)}{together}."


def _size(value: float | Sequence[float], factor: float, unit: str) -> str:
    """Return a deviation, or three along x, y and z, with its unit."""
    sizes = [f"{factor * one:.4g}" for one in (value if isinstance(value, Sequence) else [value])]
    same = set(sizes)
    if same == {"0"}:
        return "certain"
    return f"± {sizes[0] if len(same) == 1 else '/'.join(sizes)} {unit}"


def _most(told: Mapping[str, str]) -> str:
    """Return what holds for most names, and the others by name."""
    usual = Counter(told.values()).most_common(1)[0][0]
    others = ", ".join(f"{name} {size}" for name, size in told.items() if size != usual)
    return f"{usual}{'; ' if others else ''}{others}"


def _plain(value: Any) -> str:
    """Return plain data in one line."""
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_plain(one)}" for key, one in value.items())
    if isinstance(value, list | tuple):
        return "; ".join(map(_plain, value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)
