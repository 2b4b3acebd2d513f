"""The table and the plot of the corpus."""

import json
from pathlib import Path
from typing import Any

import numpy as np

HEAD = (
    "| robot | joints | links | merged | mimic | massless | s | MB | operations | outputs | error of sums | "
    "error of each link |\n|---|" + "---|" * 11
)
LIMIT = 1e-11
"""Largest error allowed, relative."""
COUNTS = {"plain": 49, "helped": 19, "never": 1}
"""Files that generate as they are, with the option that the refusal names, and not at all."""

LARGE, SMALL = 500, 10
"""Outputs from which growth is measured."""
LABELLED = ("tiago_dual", "human", "panda", "iris", "TwoDofs", "talos_full_v2", "solo12")


def line(row: dict[str, Any]) -> str:
    """One row of the Markdown table."""
    flags = "".join(
        f" --{key.replace('_', '-')}" + ("" if value is True else f" {value}")
        for key, value in row["options"].items()
    )
    name = Path(row["file"]).stem + flags
    if "seconds" not in row:
        reason = row.get("refused") or f"CRASHED: {row.get('crashed')}"
        return f"| {name} | {reason} |" + " |" * 10
    return (
        f"| {name} | {row['joints']} | {row['links']} | {row['merged']} | {row['mimic']} | "
        f"{row['massless']} | {row['seconds']:.1f} | {row['megabytes']:.0f} | {row['operations']} | "
        f"{row['outputs']} | {row['error_sum']:.0e} | {row['error_link']:.0e} |"
        + "".join(f"\nFALSE ALARM of {name}: {alarm}" for alarm in row.get("alarms", ()))
    )


def sorted_out(rows: list[dict[str, Any]]) -> dict[str, set[str]]:
    """Files by the keys of `COUNTS`; one whose torques are off by more than the limit counts as never."""
    files = {row["file"] for row in rows}
    made = [row for row in rows if "seconds" in row]
    right = [row for row in made if max(row["error_sum"], row["error_link"]) <= LIMIT]
    plain = {row["file"] for row in right if not row["options"]}
    helped = {row["file"] for row in right} - plain
    return {"plain": plain, "helped": helped, "never": files - plain - helped}


def summary(rows: list[dict[str, Any]]) -> str:
    """Return in a few lines what the corpus shows."""
    files = {row["file"] for row in rows}
    made = [row for row in rows if "seconds" in row]
    plain, helped, lost = sorted_out(rows).values()
    never = sorted(Path(name).stem for name in lost)
    if not made:
        return f"{len(files)} files, none generates."
    worst = [max(row[key] for row in made) for key in ("error_sum", "error_link")]
    slowest, largest = (max(made, key=lambda row: row[key]) for key in ("seconds", "megabytes"))
    return (
        f"{len(files)} files: {len(plain)} generate as they are, {len(helped)} with the option that the "
        f"refusal names, {len(never)} never{f' ({chr(44).join(never)})' if never else ''}. "
        f"Largest errors: {worst[0]:.0e} of the sums, {worst[1]:.0e} of a link's own torque. "
        f"Slowest: {Path(slowest['file']).stem}, {slowest['seconds']:.1f} s; most memory: "
        f"{Path(largest['file']).stem}, {largest['megabytes']:.0f} MB. {growth(made)}{_checks(made)}"
    )


def _checks(made: list[dict[str, Any]]) -> str:
    """Yield what `linkwise check` said of the packages, if it was asked."""
    rows = [row for row in made if "alarms" in row]
    if not rows:
        return ""
    alarms, left = (sum(len(row[key]) for row in rows) for key in ("alarms", "left"))
    slowest, largest = (max(rows, key=lambda row: row[key]) for key in ("check_seconds", "check_megabytes"))
    return (
        f" `linkwise check` of {len(rows)} packages: {alarms} false alarms, {left} checks that could not be "
        f"made; at most {slowest['check_seconds']:.0f} s ({Path(slowest['file']).stem}) and "
        f"{largest['check_megabytes']:.0f} MB ({Path(largest['file']).stem})."
    )


def slope(made: list[dict[str, Any]], least: int) -> float:
    """Exponent p of operations ~ outputs^p among robots with at least so many outputs."""
    pairs = [(row["outputs"], row["operations"]) for row in made if row["outputs"] >= least]
    if len({outputs for outputs, _ in pairs}) < 2:
        return float("nan")
    return float(np.polyfit(*np.log(np.array(pairs, dtype=float).T), 1)[0])


def most_per_output(made: list[dict[str, Any]]) -> float:
    return float(max(row["operations"] / row["outputs"] for row in made))


def growth(made: list[dict[str, Any]]) -> str:
    """Return how operations grow with outputs; small arms have few a piece, for their axes are aligned."""
    bound = f"No robot needs more than {most_per_output(made):.1f} operations an output"
    if np.isnan(slope(made, LARGE)):
        return f"{bound}."
    return (
        f"{bound}; they grow like outputs^{slope(made, LARGE):.2f} from {LARGE} outputs on "
        f"(outputs^{slope(made, SMALL):.2f} from {SMALL} on)."
    )


def plot(rows: list[dict[str, Any]], out: Path) -> None:
    """Operations against outputs, both logarithmic, with lines of slope 1."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    made = [row for row in rows if "seconds" in row]
    x, y = (np.array([row[key] for row in made], dtype=float) for key in ("outputs", "operations"))
    names = [Path(row["file"]).stem for row in made]
    figure, axes = plt.subplots(figsize=(7.0, 5.0), layout="constrained")
    _lines(axes, x, most_per_output(made))
    axes.scatter(x, y, s=22, color="#1f5fa8", alpha=0.6, linewidth=0, zorder=2)
    for name in LABELLED:
        if name in names:
            at = names.index(name)
            axes.annotate(name, (x[at], y[at]), xytext=(6, -9), textcoords="offset points", fontsize=8)
    axes.set(
        xscale="log", yscale="log", xlabel="outputs: entries of c2, c1, g and τ that are not always zero"
    )
    axes.set_ylabel("operations (+ − × /, sin, cos)")
    title = f"{len(made)} packages: operations ~ outputs^{slope(made, LARGE):.2f} from {LARGE} outputs on"
    axes.set_title(title, loc="left", fontsize=11)
    axes.spines[["top", "right"]].set_visible(False)
    for kind in ("svg", "png"):
        figure.savefig(
            out / f"operations.{kind}", dpi=150, metadata={"Date": None} if kind == "svg" else None
        )
    plt.close(figure)


def _lines(axes: Any, x: Any, most: float) -> None:
    """One operation an output, and the most that any robot needs: lines of slope 1."""
    span = np.array([x.min() / 1.5, x.max() * 2.0])
    middle = span.prod() ** 0.5
    for ratio, side in ((1.0, "left"), (most, "right")):
        axes.plot(span, ratio * span, color="0.75", linewidth=1, zorder=1)
        axes.annotate(
            f"{ratio:.3g} operation{'s' * (ratio > 1)} an output",
            (middle, ratio * middle),
            xytext=(8, -12) if side == "left" else (-8, 6),
            textcoords="offset points",
            horizontalalignment=side,
            color="0.4",
            fontsize=8,
        )


def write(rows: list[dict[str, Any]], out: Path) -> str:
    """Write corpus.json, corpus.md and the plot; return the summary."""
    out.mkdir(parents=True, exist_ok=True)
    text = summary(rows)
    (out / "corpus.json").write_text(json.dumps(rows, indent=1) + "\n")
    (out / "corpus.md").write_text("\n".join([text, "", HEAD, *map(line, rows)]) + "\n")
    if any("seconds" in row for row in rows):
        plot(rows, out)
    return text
