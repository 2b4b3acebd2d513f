"""Every URDF of the package example-robot-data through the generator, beside Pinocchio: `make corpus`.

With `--kernel loops` through C in loops, whose seconds to compile and to answer first count too. With
`--check` every robot's package, with all its back ends, is also given to `linkwise check`: none of them is
wrong, so that a FAIL is a false alarm, which fails this.

Writes corpus.json, corpus.md and a plot: for each file its joints, links, what was merged or mimicked,
generation seconds, peak memory, operations, outputs, and the errors for the sums and for each link's own
torque, or the reason for refusing it. A refused file runs again with the option that the message names.
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

sys.path.insert(0, str(Path(__file__).parents[1]))

ROBOTS = Path(sysconfig.get_path("purelib")) / "cmeel.prefix/share/example-robot-data/robots"
WAYS_PAST = {
    "--allow-unphysical": {"allow_unphysical": True},
    "--free-mimic": {"free_mimic": True},
    "--base floating": {"base": "floating"},
}
ALSO = {"human.urdf": ({"base": "floating"},)}
"""Further options to run a file with."""


def study(path: Path, options: dict[str, Any], samples: int, kernel: str = "straight") -> dict[str, Any]:
    """Generate one robot in this process and compare it; a process of its own makes peak memory honest."""
    from linkwise import LinkwiseError, Options, generate, read_system, write_package
    from linkwise.package.load import import_package

    row: dict[str, Any] = {"file": str(path.relative_to(ROBOTS)), "options": options}
    start = time.perf_counter()
    try:
        system = read_system(path, Options(**options))
    except LinkwiseError as error:
        return row | {"refused": str(error).removeprefix(f"{path}: ")}
    backends = ("native",) if kernel == "loops" else ("numpy", "c")
    files = generate(system, backends, "robot", kernel=kernel)
    row["seconds"] = time.perf_counter() - start
    row["megabytes"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    notes = Counter(note.kind for note in system.robot.notes) if system.robot else Counter()
    row |= {kind: notes[kind] for kind in ("merged", "mimic", "massless", "unphysical")}
    row |= {"joints": len(system.coordinates), "links": len(system.links)}
    manifest = json.loads(files["manifest.json"])
    row["operations"] = sum(link["operations"] for link in manifest["links"])
    with tempfile.TemporaryDirectory() as folder:
        write_package(files, Path(folder) / "robot")
        package = import_package(Path(folder) / "robot")
        ways = [("native", "auto")] if kernel == "loops" else [("numpy", "straight"), ("numpy", "rule")]
        loaded = [package.load(backend, kernel=way) for backend, way in ways]
        if kernel == "loops":
            loaded[0].packed(*np.zeros((3, loaded[0].n)))
            row["seconds"] = time.perf_counter() - start
        row["outputs"] = sum(len(block) for block in loaded[0].layout)
        errors = [compare(path, options, system, dynamics, samples) for dynamics in loaded]
    return row | {name: max(error[name] for error in errors) for name in errors[0]}


def compare(
    path: Path, options: dict[str, Any], system: Any, dynamics: Any, samples: int
) -> dict[str, float]:
    """Largest errors of the sums and of each link's own torque, in a ratio to the largest of their kind."""
    from numeric.pinocchio_model import PinocchioModel

    oracle = PinocchioModel(path, system, floating=options.get("base") == "floating")
    generator = np.random.default_rng(0)
    q = generator.uniform(-3.0, 3.0, (samples, dynamics.n))
    qd, qdd = generator.uniform(-2.0, 2.0, (2, samples, dynamics.n))
    states = list(zip(q, qd, qdd, strict=True))
    tau = dynamics.inverse_dynamics(q, qd, qdd)
    packed = dynamics.packed_torque(q, qd, qdd)
    sums = np.stack([oracle.torque(*state) for state in states])
    error_link = 0.0
    for j, name in enumerate(dynamics.link_names):
        own = np.stack([oracle.torque(*state, link=name) for state in states])
        mine = np.zeros_like(own)
        rows = dynamics.layout.torque[:, 1] == j
        mine[:, dynamics.layout.torque[rows, 0]] = packed[:, rows]
        error_link = max(error_link, relative(mine, own))
    return {"error_sum": relative(tau, sums), "error_link": error_link}


def relative(mine: Any, reference: Any) -> float:
    return float(np.abs(mine - reference).max() / max(np.abs(reference).max(), 1e-300))


def checked(path: Path, options: dict[str, Any]) -> dict[str, Any]:
    """Return what `linkwise check` says of a robot's package, in which seconds and MB."""
    flags = [
        flag
        for key, value in options.items()
        for flag in (f"--{key.replace('_', '-')}", *(() if value is True else (value,)))
    ]
    call = [sys.executable, "-m", "linkwise"]
    with tempfile.TemporaryDirectory() as folder:
        made = [*call, "generate", str(path), "--out", folder, "--name", "robot", *flags]
        subprocess.run(made, check=True, capture_output=True)
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
        start = time.perf_counter()
        done = subprocess.run(
            [*call, "check", f"{folder}/robot", "--json"], capture_output=True, text=True, check=False
        )
        seconds = time.perf_counter() - start
    # Of whichever of the two took more.
    megabytes = max(before, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss) / 1024
    results = json.loads(done.stdout)
    alarms = [f"{result['name']}: {result['detail']}" for result in results if result["mark"] == "FAIL"]
    left = [result["name"] for result in results if result["mark"] == "skip"]
    return {"alarms": alarms, "left": left, "check_seconds": seconds, "check_megabytes": megabytes}


def run(path: Path, options: dict[str, Any], samples: int, kernel: str, check: bool) -> dict[str, Any]:
    """Study one robot in a fresh process."""
    chosen = ["--one", str(path), "--options", json.dumps(options), "--samples", str(samples)]
    chosen += ["--kernel", kernel, *(["--check"] if check else [])]
    done = subprocess.run([sys.executable, __file__, *chosen], capture_output=True, text=True, check=False)
    if done.returncode:
        file = str(path.relative_to(ROBOTS))
        return {"file": file, "options": options, "crashed": done.stderr.strip().splitlines()[-1]}
    return json.loads(done.stdout)  # type: ignore[no-any-return]


def ways(path: Path, samples: int, kernel: str, check: bool) -> list[dict[str, Any]]:
    """Rows of one file: as it is, with the options that its refusals name, and those of ALSO."""
    rows = [run(path, {}, samples, kernel, check)]
    while "refused" in rows[-1]:
        last = rows[-1]
        past = [way for flag, way in WAYS_PAST.items() if flag in last["refused"]]
        if not past or past[0].items() <= last["options"].items():
            break
        rows.append(run(path, last["options"] | past[0], samples, kernel, check))
    return rows + [run(path, options, samples, kernel, check) for options in ALSO.get(path.name, ())]


def main() -> None:
    """Run the corpus, or one robot of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/corpus"))
    parser.add_argument("--samples", type=int, default=100)
    parser.add_argument("--only", default="", help="part of a file's name")
    parser.add_argument("--kernel", choices=("straight", "loops"), default="straight")
    parser.add_argument("--check", action="store_true", help="run `linkwise check` on every package")
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--options", default="{}", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        options = json.loads(arguments.options)
        row = study(arguments.one, options, arguments.samples, arguments.kernel)
        if arguments.check and "refused" not in row:
            row |= checked(arguments.one, options)
        print(json.dumps(row))
        return
    from tools.corpus_report import COUNTS, HEAD, line, sorted_out, write

    rows: list[dict[str, Any]] = []
    print(HEAD)
    for path in sorted(ROBOTS.rglob("*.urdf"), key=lambda p: (p.name, p)):
        if arguments.only in path.name:
            rows += (new := ways(path, arguments.samples, arguments.kernel, arguments.check))
            print("\n".join(map(line, new)), flush=True)
    print(write(rows, arguments.out))
    if any(row.get("alarms") for row in rows):
        sys.exit("linkwise check fails packages that are right, see above")
    counts = {key: len(files) for key, files in sorted_out(rows).items()}
    if not arguments.only and counts != COUNTS:
        sys.exit(f"docs/robots.md says {COUNTS}, here it is {counts}")


if __name__ == "__main__":
    main()
