"""Speed of the generated code beside Pinocchio and CasADi: one table, one JSON file.

    python tests/benchmarks/bench_speed.py --out out/bench [--quick] [--only ROBOT]

Times are nanoseconds a sample of the full decomposition (every tau_ij, c2_ijk, c1_ijk and g_ij), the least of
several rounds in which everything of one robot has its turn. Machines drift and other work disturbs: compare
ratios of one run. The last line is one for docs/speed.md.
"""

import argparse
import datetime
import json
import os
import platform
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

from linkwise_runtime.version import VERSION
from speed import casadi_peer, control_steps, emitted, pinocchio_peer, python_calls
from speed.cases import CASES, Case
from speed.limits import Mix, limits, mix
from speed.package import Package, compiler, prepare, run
from speed.results import Results
from speed.table import history, markdown

ROUNDS = 3
"""Turns that our C, Pinocchio and CasADi have each."""


def measure(case: Case, work: Path, quick: bool, results: Results) -> None:
    """Everything about one robot, added to the results."""
    seconds, largest = (0.05, 16384) if quick else (0.3, 65536)
    say(case.name, "generate, compile")
    package = prepare(case, work, case.kernel)
    results.packages.append(facts(package))
    say(case.name, "C, beside Pinocchio and CasADi")
    beside_peers(case, package, work, (largest, seconds, 30.0 if quick else 300.0), results)
    if case.control:
        results.figures += control_steps.measure(package, work)
    say(case.name, "Python")
    figures, peers = python_calls.measure(package, largest, seconds, case.every_backend)
    results.figures += figures
    if case.peers:
        results.from_python[case.name] = peers
    if results.mix is None or case.name == "panda":
        results.mix = mix(package)


def beside_peers(
    case: Case, package: Package, work: Path, limit: tuple[int, float, float], results: Results
) -> None:
    """Our C and the peers in C and C++ by turns; `limit`: batch, seconds a figure, seconds to compile."""
    largest, seconds, compiling = limit
    programs = emitted.programs(package, work)
    if not case.casadi:
        results.notes.append(f"{case.name}: CasADi was not tried")
    elif case.peers:
        try:
            results.casadi[case.name] = casadi_peer.measure(package, work, compiling)
            if (level := results.casadi[case.name].level) != "-O3":
                results.notes.append(f"{case.name}: CasADi's C compiled at {level}, as -O3 took too long")
        except (ImportError, RuntimeError) as error:
            results.notes.append(f"{case.name}: no CasADi: {str(error)[:200]}")
    rounds = []
    for _ in range(ROUNDS):
        rounds.append(emitted.measure(package, programs, largest, seconds / ROUNDS))
        if case.peers:
            pinocchio_again(case, package, work, results)
        if case.name in results.casadi:
            results.casadi[case.name] = casadi_peer.again(results.casadi[case.name], package, work)
    results.figures += emitted.least(rounds)


def pinocchio_again(case: Case, package: Package, work: Path, results: Results) -> None:
    """One round of Pinocchio; why there is none is a note."""
    try:
        found = pinocchio_peer.measure(package, work)
    except (ImportError, RuntimeError, ValueError) as error:
        note = f"{case.name}: no Pinocchio: {str(error)[:200]}"
        results.notes += [note] * (note not in results.notes)
    else:
        results.pinocchio[case.name] = found.best_of(results.pinocchio.get(case.name))


def facts(package: Package) -> dict[str, object]:
    """Return the results of generating and compiling, in words."""
    return {
        "robot": package.name,
        "joints": package.sizes["JOINTS"],
        "links": len(package.manifest["links"]),
        "outputs": package.outputs,
        "operations": package.operations,
        "generate_seconds": round(package.generate_seconds, 2),
        "compile_seconds": {real: round(took, 2) for real, took in package.compile_seconds.items()},
        "code_bytes": package.code_bytes,
    }


def machine() -> dict[str, object]:
    """Processor, vectors and compiler; when, and which linkwise."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        processor = next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
        flags = next(line.split() for line in lines if line.startswith("flags"))
    except (OSError, StopIteration):
        processor, flags = platform.processor(), []
    known = {"avx512f": "AVX-512", "avx2": "AVX2"}
    return {
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "linkwise": VERSION,
        "processor": processor,
        "vectors": next((name for flag, name in known.items() if flag in flags), platform.machine()),
        "cores": os.cpu_count(),
        "compiler": run([compiler() or "cc", "--version"]).splitlines()[0],
    }


def chooses_kernels() -> bool:
    """Return whether `generate` has a choice of kernels."""
    command = [sys.executable, "-m", "linkwise", "generate", "--help"]
    return "--kernel" in subprocess.run(command, check=True, capture_output=True, text=True).stdout


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
    choice = chooses_kernels()
    for case in CASES:
        if arguments.only in (None, case.name) and (choice or case.kernel is None):
            measure(case, work, arguments.quick, results)
    results.limits = limits(work, results.mix or Mix(0.0, 0.5), results.sizes_written())
    text = markdown(results)
    print(text)
    (arguments.out / "speed.md").write_text(text + "\n", encoding="utf-8")
    (arguments.out / "speed.json").write_text(json.dumps(asdict(results), indent=1) + "\n", encoding="utf-8")
    print(f"\nFor docs/speed.md:\n{history(results)}")


if __name__ == "__main__":
    main()
