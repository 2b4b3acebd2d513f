"""Speed of the generated code beside Pinocchio and CasADi: one table, one JSON file.

    python tests/benchmarks/bench_speed.py --out out/bench [--quick] [--only ROBOT]

Times are nanoseconds a sample of the full decomposition (every tau_ij, c2_ijk, c1_ijk and g_ij), the least
of several repeats. Machines drift and other work disturbs: compare ratios of one run.
"""

import argparse
import json
import os
import platform
import sys
from dataclasses import asdict
from pathlib import Path

from speed import casadi_peer, emitted, pinocchio_peer, python_calls
from speed.cases import CASES, Case
from speed.limits import limits
from speed.package import Package, compiler, prepare, run
from speed.results import Results
from speed.table import markdown


def measure(case: Case, work: Path, quick: bool, results: Results) -> None:
    """Everything about one robot, added to the results."""
    seconds, largest = (0.05, 16384) if quick else (0.3, 65536)
    say(case.name, "generate, compile")
    package = prepare(case, work)
    results.packages.append(facts(package))
    say(case.name, "C")
    results.figures += emitted.measure(package, work, largest, seconds)
    say(case.name, "Pinocchio")
    try:
        results.pinocchio[case.name] = pinocchio_peer.measure(package, work)
    except (ImportError, RuntimeError, ValueError) as error:
        results.notes.append(f"{case.name}: no Pinocchio: {str(error)[:200]}")
    if case.casadi:
        say(case.name, "CasADi")
        try:
            results.casadi[case.name] = casadi_peer.measure(package, work)
        except (ImportError, RuntimeError) as error:
            results.notes.append(f"{case.name}: no CasADi: {str(error)[:200]}")
    say(case.name, "Python")
    figures, notes = python_calls.measure(package, largest, seconds, case.every_backend)
    results.figures += figures
    results.notes += notes


def facts(package: Package) -> dict[str, object]:
    """What generating and compiling came to."""
    return {
        "robot": package.name,
        "joints": package.sizes["JOINTS"],
        "outputs": package.outputs,
        "operations": package.operations,
        "generate_seconds": round(package.generate_seconds, 2),
        "compile_seconds": {real: round(took, 2) for real, took in package.compile_seconds.items()},
        "code_bytes": package.code_bytes,
    }


def machine() -> dict[str, object]:
    """Processor and compiler."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        processor = next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        processor = platform.processor()
    version = run([compiler() or "cc", "--version"]).splitlines()[0]
    return {"processor": processor, "cores": os.cpu_count(), "compiler": version}


def say(robot: str, what: str) -> None:
    """Tell how far we are."""
    print(f"{robot}: {what}", file=sys.stderr, flush=True)


def main() -> None:
    """Measure, print the table, write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--out", type=Path, required=True, help="directory for speed.json, speed.md, packages"
    )
    parser.add_argument("--quick", action="store_true", help="fewer repeats, smaller batches")
    parser.add_argument("--only", choices=[case.name for case in CASES], help="one robot")
    arguments = parser.parse_args()
    work = (arguments.out / "work").resolve()
    work.mkdir(parents=True, exist_ok=True)
    results = Results(machine=machine())
    for case in CASES:
        if arguments.only in (None, case.name):
            measure(case, work, arguments.quick, results)
    results.limits = limits(work, results.bytes_written())
    text = markdown(results)
    print(text)
    (arguments.out / "speed.md").write_text(text + "\n", encoding="utf-8")
    (arguments.out / "speed.json").write_text(json.dumps(asdict(results), indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
