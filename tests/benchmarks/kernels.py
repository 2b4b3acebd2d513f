"""Straight lines beside loops, by robot: how docs/kernels.md and the choice of `--kernel auto` are measured.

    python tests/benchmarks/kernels.py --out out/kernels [--only ROBOT]

Ratios of the times of loops to those of straight lines, taken in turns within one program: blocks of 256
samples, and one sample. Compiling the larger straight kernels takes minutes.
"""

import argparse
import importlib
import os
import re
import subprocess
import sys
import time
from pathlib import Path

from speed.cases import FINGERS, Case, built_in, chain_file, shipped
from speed.package import PEERS, compiler, run

FLOATING = ("--base", "floating")
CASES = (
    Case("panda", shipped("panda.urdf"), FINGERS),
    Case("chain8", chain_file(8)),
    Case("planar10", built_in("planar10")),
    Case("planar14", built_in("planar14")),
    Case("planar20", built_in("planar20")),
    Case("chain12", chain_file(12)),
    Case("solo12", shipped("solo12.urdf"), FLOATING),
    Case("talos", shipped("talos_reduced.urdf")),
    Case("chain16", chain_file(16)),
    Case("chain20", chain_file(20)),
    Case("humanoid", shipped("simple_humanoid.urdf"), FLOATING),
    Case("chain24", chain_file(24)),
)


def compiled(case: Case, kernel: str, work: Path) -> tuple[Path, dict[str, int], float, float]:
    """Library of one kernel, numbers of its header, seconds to generate and to compile."""
    name = f"{kernel}_{case.name}"
    command = [sys.executable, "-m", "linkwise", "generate", case.robot(work), *case.options]
    start = time.perf_counter()
    chosen = ["--kernel", kernel, "--backend", "native", "--name", name, "--out", str(work)]
    subprocess.run([*command, *chosen], check=True, capture_output=True)
    generated = time.perf_counter() - start
    build = importlib.import_module("linkwise_runtime.native.build")
    start = time.perf_counter()
    library = build.library(build.Sources(name, work / name / "c"), "double")
    took = time.perf_counter() - start
    header = (work / name / "c" / f"{name}.h").read_text(encoding="utf-8")
    numbers = re.findall(rf"{name.upper()}_(\w+) = (\d+)", header)
    return library, {key: int(value) for key, value in numbers}, generated, took


def measure(case: Case, work: Path) -> str:
    """One row of the table."""
    libraries, rows = [], []
    for kernel in ("loops", "straight"):
        library, sizes, generated, took = compiled(case, kernel, work)
        libraries.append(library)
        rows.append(f"{generated:.1f} + {took:.1f}")
    program = work / f"kernels_{case.name}"
    names = [f"-D{kernel.upper()}={kernel}_{case.name}" for kernel in ("loops", "straight")]
    paths = [f"-Wl,-rpath,{library.parent}" for library in libraries]
    source = [str(PEERS / "kernels.c"), *map(str, libraries), *paths, "-lm", "-o", str(program)]
    run([compiler() or "cc", "-std=gnu99", "-O2", *names, *source])
    given = [str(sizes[key]) for key in ("JOINTS", "C2", "C1", "G")]
    found = run([str(program), *given]).split()
    values = sizes["C2"] + sizes["C1"] + 2 * sizes["G"]
    return f"| {case.name} | {values} | {found[0]} | {found[1]} | {rows[0]} | {rows[1]} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/kernels"))
    parser.add_argument("--only", choices=[case.name for case in CASES], help="one robot")
    arguments = parser.parse_args()
    work = arguments.out.resolve()
    work.mkdir(parents=True, exist_ok=True)
    sys.path.insert(0, str(work))
    os.environ["LINKWISE_CACHE"] = str(work / "cache")
    print("| robot | values | blocks | one sample | loops: s to generate + compile | straight |")
    print("|---|---|---|---|---|---|")
    for case in CASES:
        if arguments.only in (None, case.name):
            print(measure(case, work), flush=True)


if __name__ == "__main__":
    main()
