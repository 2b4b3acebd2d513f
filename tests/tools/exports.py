"""Every call of the table in docs/exports.md, each way that it has, a line each; status 1 where it is wrong.

python tests/tools/exports.py --out out/exports [CALL...]
"""

import argparse
import logging
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch

sys.path.insert(0, str(Path(__file__).parents[1]))

from helpers.exported import WAYS, error, exported, in_onnx, module_of, motion, results, table
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package

ROBOT, NEAR = "puma560", 1e-11
SAMPLES = (7, 1, 0)
OF_MOTION = ("trace", "counterfactual")
"""Calls whose first axis is time along a motion, which is not one of any number of samples."""


def goes(load: Callable[[], Any], call: str) -> dict[str, str]:
    """Return what stands in the way of each way of exporting; nothing where it goes, and says what the call
    says."""
    module, count = module_of(load(), call)
    motions = [motion(load(), count, samples, samples) for samples in SAMPLES]
    expected = [dict(enumerate(results(module(*given)))) for given in motions]
    made: dict[str, Callable[..., Any]] = {}
    told: dict[str, str] = {}

    def by(way: str, make: Callable[[], Callable[..., Any]]) -> None:
        try:
            made[way] = make()
            for given, wanted in zip(motions, expected, strict=True):
                off = error(dict(enumerate(made[way](*given))), wanted)
                told[way] = "" if off <= NEAR else f"off by {off:.0e}"
                if told[way]:
                    return
        except Exception as fault:  # of any library on the way
            told[way] = f"{type(fault).__name__}: {fault.__cause__ or fault}".splitlines()[0][:200]

    # Of robots that have not been called before, whose tables a compiler must find made.
    fresh = module_of(load(), call)[0]
    compiled = torch.compile(fresh, fullgraph=True, backend="eager")
    by("compile", lambda: lambda *given: results(compiled(*given)))
    programs: list[Any] = []

    def export() -> Callable[..., Any]:
        programs.append(exported(module_of(load(), call)[0], motion(load(), count, 5)))
        return lambda *given: results(programs[0].module()(*given))

    by("export", export)
    by("ONNX", lambda: in_onnx(programs[0]))
    torch._dynamo.reset()
    return told


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("calls", nargs="*")
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    logging.disable(logging.WARNING)
    write_package(generate(read_system(ROBOT), ["torch"]), asked.out / ROBOT)
    package, wrong, calls = import_package(asked.out / ROBOT), 0, 0
    for call, stated in table():
        if call in OF_MOTION:
            continue
        if not asked.calls or call in asked.calls:
            told = goes(lambda: package.load("torch"), call)
            lies = [way for way in WAYS if stated[way] == bool(told[way])]
            wrong, calls = wrong + len(lies), calls + 1
            shown = (f"{way} {told[way] or 'yes'}{', not as stated' * (way in lies)}" for way in WAYS)
            print(f"{call}: {'; '.join(shown)}", flush=True)
    print(f"{calls} calls, {len(WAYS)} ways each, {wrong} not as stated")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
