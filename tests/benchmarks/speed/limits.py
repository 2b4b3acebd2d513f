"""The most that the machine can do."""

import re
import shutil
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from speed.package import PEERS, Package, build_flags, compiler, pairs, run

MIX = 32
"""Instructions of arithmetic in one round of peers/limits.c."""
DECOMPOSITION = re.compile(r"<link_\d+_decomposition_block\w*>:")
"""Functions that compute the decomposition of blocks, in straight lines."""


@dataclass(frozen=True)
class Mix:
    """Share of fused operations and of products among the instructions of arithmetic; the others are sums."""

    fused: float
    products: float

    def flags(self) -> list[str]:
        """Definitions for peers/limits.c."""
        return [f"-DFUSED={round(MIX * self.fused)}", f"-DPRODUCTS={round(MIX * self.products)}"]


def mix(package: Package) -> Mix:
    """Instructions of the compiled closed forms; half sums, half products where they cannot be counted."""
    counts = {"fma": 0, "mul": 0, "add": 0, "sub": 0}
    if shutil.which("objdump"):
        command = ["objdump", "-d", "--no-show-raw-insn", str(package.libraries["double"])]
        text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        for function in text.split("\n\n"):
            if DECOMPOSITION.search(function):
                for kind in re.findall(r"\tv?(?:fn?(m)(?:add|sub)\w*|(mul|add|sub))[sp]d\b", function):
                    counts["fma" if kind[0] else kind[1]] += 1
    every = sum(counts.values())
    return Mix(counts["fma"] / every, counts["mul"] / every) if every else Mix(0.0, 0.5)


def limits(work: Path, forms: Mix, sizes: Iterable[int]) -> dict[str, float]:
    """GFlop/s in registers, in the mix of the emitted code, and GB/s of writing arrays of the given bytes."""
    program = work / "limits"
    flags = ["-std=gnu99", *build_flags(), *forms.flags()]
    run([compiler() or "cc", *flags, str(PEERS / "limits.c"), "-o", str(program)])
    return pairs(run([str(program), *(str(size) for size in sorted(set(sizes)))]))
