"""Every URDF of the package example-robot-data through the generator, beside Pinocchio: `make corpus`.

Writes corpus.md and corpus.json: for each file its joints, links, what was merged or mimicked, generation seconds, peak
memory, operations, outputs, and the errors for the sums and for each link's own torque, or the reason for refusing.
"""

import argparse
import json
import resource
import subprocess
import sys
import sysconfig
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

ROBOTS = Path(sysconfig.get_path("purelib")) / "cmeel.prefix/share/example-robot-data/robots"


def study(path: Path, options: dict[str, Any], samples: int) -> dict[str, Any]:
    """Generate one robot in this process and compare it; runs in a process of its own for an honest peak memory."""
    from linkwise import LinkwiseError, Options, generate, read_system, write_package
    from linkwise.check.package import import_package

    row: dict[str, Any] = {"file": path.stem, "options": options}
    start = time.perf_counter()
    try:
        system = read_system(path, Options(**options))
    except LinkwiseError as error:
        return row | {"refused": str(error).removeprefix(f"{path}: ")}
    files = generate(system, ("numpy", "c"), "robot")
    row["seconds"] = time.perf_counter() - start
    row["megabytes"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    notes = Counter(note.kind for note in system.robot.notes)
    row |= {kind: notes[kind] for kind in ("merged", "mimic", "massless", "unphysical")}
    row |= {"joints": len(system.coordinates), "links": len(system.links)}
    manifest = json.loads(files["manifest.json"])
    row["operations"] = sum(link["operations"] for link in manifest["links"])
    with tempfile.TemporaryDirectory() as folder:
        write_package(files, Path(folder) / "robot")
        dynamics = import_package(Path(folder) / "robot").load("numpy")
    layout = dynamics.layout
    row["outputs"] = sum(len(block) for block in layout)
    return row | compare(path, options, system, dynamics, samples)


def compare(path: Path, options: dict[str, Any], system: Any, dynamics: Any, samples: int) -> dict[str, Any]:
    """Largest errors of the sums and of each link's own torque, relative to the largest torque of their kind."""
    from numeric.pinocchio_model import PinocchioModel

    oracle = PinocchioModel(path, system, floating=options.get("base") == "floating")
    generator = np.random.default_rng(0)
    q = generator.uniform(-3.0, 3.0, (samples, dynamics.n))
    qd, qdd = generator.uniform(-2.0, 2.0, (2, samples, dynamics.n))
    tau = dynamics.inverse_dynamics(q, qd, qdd)
    packed = dynamics.packed_torque(q, qd, qdd)
    sums = np.stack([oracle.torque(*state) for state in zip(q, qd, qdd, strict=True)])
    error_sum = np.abs(tau - sums).max() / np.abs(sums).max()
    error_link = 0.0
    for j, name in enumerate(dynamics.link_names):
        own = np.stack([oracle.torque(*state, link=name) for state in zip(q, qd, qdd, strict=True)])
        mine = np.zeros_like(own)
        rows = dynamics.layout.torque[:, 1] == j
        mine[:, dynamics.layout.torque[rows, 0]] = packed[:, rows]
        error_link = max(error_link, np.abs(mine - own).max() / max(np.abs(own).max(), 1e-300))
    return {"error_sum": float(error_sum), "error_link": float(error_link)}


def run(path: Path, options: dict[str, Any], samples: int) -> dict[str, Any]:
    """Study one robot in a fresh process."""
    command = [
        sys.executable,
        __file__,
        "--one",
        str(path),
        "--options",
        json.dumps(options),
        "--samples",
        str(samples),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        return {"file": path.stem, "options": options, "crashed": done.stderr.strip().splitlines()[-1:]}
    return json.loads(done.stdout)  # type: ignore[no-any-return]


def way_past(row: dict[str, Any]) -> dict[str, Any]:
    """Options of the refused run, with the one that its message names."""
    named = {"--allow-unphysical": ("allow_unphysical", True), "--free-mimic": ("free_mimic", True)}
    named["--base floating"] = ("base", "floating")
    for flag, (option, value) in named.items():
        if flag in row["refused"] and option not in row["options"]:
            return row["options"] | {option: value}
    return {}


def line(row: dict[str, Any]) -> str:
    """One row of the Markdown table."""
    name = row["file"] + "".join(f" --{key.replace('_', '-')}" for key in row["options"])
    if "seconds" not in row:
        return f"| {name} | {row.get('refused') or row.get('crashed')} |" + " |" * 10
    return (
        f"| {name} | {row['joints']} | {row['links']} | {row['merged']} | {row['mimic']} | {row['massless']} | "
        f"{row['seconds']:.1f} | {row['megabytes']:.0f} | {row['operations']} | {row['outputs']} | "
        f"{row['error_sum']:.0e} | {row['error_link']:.0e} |"
    )


HEAD = (
    "| robot | joints | links | merged | mimic | massless | s | MB | operations | outputs | error of sums | "
    "error of each link |\n|---|" + "---|" * 11
)


def main() -> None:
    """Run the corpus, or one robot of it."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, default=Path("out/corpus"))
    parser.add_argument("--samples", type=int, default=100)
    parser.add_argument("--only", default="")
    parser.add_argument("--one", type=Path)
    parser.add_argument("--options", default="{}")
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(study(arguments.one, json.loads(arguments.options), arguments.samples)))
        return
    rows = []
    print(HEAD)
    for path in sorted(ROBOTS.rglob("*.urdf"), key=lambda p: p.name):
        if arguments.only not in path.name:
            continue
        rows.append(run(path, {}, arguments.samples))
        print(line(rows[-1]), flush=True)
        while "refused" in rows[-1] and (options := way_past(rows[-1])):
            rows.append(run(path, options, arguments.samples))
            print(line(rows[-1]), flush=True)
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "corpus.json").write_text(json.dumps(rows, indent=1))
    (arguments.out / "corpus.md").write_text("\n".join([HEAD, *map(line, rows)]) + "\n")


if __name__ == "__main__":
    main()
