"""Growth with the number of joints: seconds to generate, operations, outputs; a plot and the numbers.

    python tests/benchmarks/growth.py --out out/bench [--most 60]

The chains are those of speed/cases.py: axes at ±90°, full inertia tensors. Seconds are the processor's for
one `linkwise generate --backend c`, start of Python included.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from speed.cases import chain

JOINTS = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 15, 20, 25, 30, 40, 50, 60)
INK, BLUE, ORANGE = "#333333", "#0072b2", "#d55e00"


def spent() -> float:
    """Processor seconds of the processes started so far."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def measure(joints: int, repeats: int) -> dict[str, float]:
    """Generate the chain's C; the least seconds of some repeats."""
    with tempfile.TemporaryDirectory() as place:
        urdf = Path(place, "chain.urdf")
        urdf.write_text(chain(joints), encoding="utf-8")
        command = [sys.executable, "-m", "linkwise", "generate", str(urdf), "--backend", "c"]
        seconds = []
        for _ in range(repeats):
            start = spent()
            subprocess.run([*command, "--name", "chain", "--out", place], check=True, capture_output=True)
            seconds.append(spent() - start)
        manifest = json.loads(Path(place, "chain", "manifest.json").read_text(encoding="utf-8"))
    operations = sum(link["operations"] for link in manifest["links"])
    sizes = [len(link["path"]) for link in manifest["links"]]
    outputs = sum(m * (m + 1) // 2 + m * m + 2 * m for m in sizes)
    return {"joints": joints, "seconds": min(seconds), "operations": operations, "outputs": outputs}


def plot(rows: list[dict[str, float]], out: Path) -> None:
    """Two panels over the number of joints: seconds, and operations beside outputs."""
    style = {"axes.spines.top": False, "axes.spines.right": False, "svg.hashsalt": "growth", "font.size": 9}
    x = [row["joints"] for row in rows]
    with plt.rc_context(style):
        figure, (left, right) = plt.subplots(1, 2, figsize=(8.4, 3.3), layout="constrained")
        left.plot(x, [row["seconds"] for row in rows], "o-", color=BLUE, markersize=3.5)
        left.set(
            title="Processor seconds to generate the C",
            xlabel="joints of a ±90° chain",
            xlim=(0, None),
            ylim=(0, None),
        )
        for key, colour in (("operations", BLUE), ("outputs", ORANGE)):
            values = [row[key] for row in rows]
            right.plot(x, values, "o-", color=colour, markersize=3.5)
            label = {"operations": "additions and\nmultiplications", "outputs": "outputs"}[key]
            right.annotate(
                label, (x[-1], values[-1]), (6, 0), textcoords="offset points", color=colour, va="center"
            )
        right.set(title="Operations and outputs of one sample", xlabel="joints (both axes logarithmic)")
        right.set(xscale="log", yscale="log")
        ticks = [t for t in (1, 2, 5, 10, 20, 60) if t <= x[-1]]
        right.set_xticks(ticks, [str(t) for t in ticks])
        right.minorticks_off()
        for axes in (left, right):
            axes.grid(color="#e5e5e5", linewidth=0.6)
            axes.set_axisbelow(True)
            axes.title.set_color(INK)
        for suffix, metadata in (("svg", {"Date": None}), ("png", {})):
            figure.savefig(out / f"growth.{suffix}", dpi=160, metadata=metadata)
        plt.close(figure)


def main() -> None:
    """Measure, print, plot."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--most", type=int, default=60, help="joints of the longest chain")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    rows = []
    print("| joints | outputs | operations | an output | seconds |\n|---|---|---|---|---|")
    for joints in (j for j in JOINTS if j <= arguments.most):
        row = measure(joints, 3 if joints <= 10 else 1)
        rows.append(row)
        each = row["operations"] / row["outputs"]
        print(
            f"| {joints} | {row['outputs']:,} | {row['operations']:,} | {each:.1f} | {row['seconds']:.2f} |",
            flush=True,
        )
    (arguments.out / "growth.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    plot(rows, arguments.out)


if __name__ == "__main__":
    main()
