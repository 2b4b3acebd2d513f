"""The emitted C on a Cortex-M that QEMU plays: what it answers, its stack, and its instructions.

    python tests/tools/cortex_m.py

prints the table of docs/embedded.md. QEMU counts instructions; how many cycles these take is the
processor's affair.
"""

import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from conftest import LOCKED_FINGERS, PANDA
from helpers.answers import random_states
from helpers.compiled import name_of
from helpers.kept import run_kept
from helpers.needed import missing
from linkwise import Options, generate, read_system, write_package

HERE = Path(__file__).parents[1] / "embedded"
TOOLS = ("arm-none-eabi-gcc", "qemu-system-arm")
SAMPLES, REPEATS, TICK = 4, 8, 40
"""Different states, how often each is computed for the count of instructions, and instructions a tick."""


@dataclass(frozen=True)
class Board:
    """A machine of QEMU's, and the flags that compile for its processor."""

    machine: str
    processor: tuple[str, ...]


BOARDS = {
    "M4F": Board("mps2-an386", ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16")),
    "M7": Board("mps2-an500", ("-mcpu=cortex-m7", "-mfpu=fpv5-d16")),
}
COMPILER = ("arm-none-eabi-gcc", "-std=c99", "-mthumb", "-mfloat-abi=hard", "-ffp-contract=fast")
SMALL = ("-Os", "-DLINKWISE_SMALL", "-ffunction-sections", "-fdata-sections")


@dataclass(frozen=True)
class Measured:
    """Measurement of one function: answers of each sample, bytes of stack, instructions a sample."""

    values: Any
    stack: int
    instructions: int


@dataclass(frozen=True)
class Call:
    """A function to try: its call, with NAME, F for float's f, `out` and sample s; and values it writes."""

    text: str
    values: int


def calls(n: int, links: int) -> dict[str, Call]:
    """Functions that a controller may want, for sample s."""
    motion, cube = "q[s], qd[s], qdd[s]", n * links * n
    return {
        "inverse_dynamics": Call(f"NAME_inverse_dynamicsF(1, {motion}, out)", n),
        "partial_torque": Call(f"NAME_partial_torqueF(1, {motion}, out)", n * links),
        "propagation": Call(
            f"NAME_propagationF(1, {motion}, out, out + {cube}, out + {2 * cube})", 2 * cube + n * links
        ),
        "mass_matrix": Call("NAME_mass_matrixF(q[s], out)", n * n),
        "forward_dynamics": Call(f"(void)NAME_forward_dynamicsF({motion}, out)", n),
        "partial_impedance": Call(
            "(void)NAME_partial_impedanceF(q[s], qd[s], &wanted, qdd[s], qd[s], qdd[s], NULL, NULL, out, "
            "NULL)",
            n,
        ),
    }


def program(name: str, real: str, motion: Any, functions: dict[str, Call]) -> str:
    """Return main.c, which answers with each function's name, stack, ticks, and its values as bits."""
    n, suffix = motion.shape[-1], "f" if real == "float" else ""
    rows = (
        ", ".join("{" + ", ".join(f"{value!r}{suffix}" for value in row) + "}" for row in array)
        for array in motion.tolist()
    )
    arrays = "".join(
        f"static real {array}[{SAMPLES}][{n}] = {{{text}}};\n"
        for array, text in zip(("q", "qd", "qdd"), rows, strict=True)
    )
    inertia = ", ".join(str(0.5 * (e % (n + 1) == 0)) for e in range(n * n))
    bodies = "".join(
        f"static void run_{key}(int s)\n{{\n    {text};\n}}\n"
        for key, call in functions.items()
        for text in [call.text.replace("NAME", name).replace("F(", f"{suffix}(")]
    )
    tries = "".join(f'    try("{key}", run_{key}, {call.values});\n' for key, call in functions.items())
    return f"""#include "{name}.h"
#include "board.h"
typedef {real} real;
{arrays}static real out[{max(call.values for call in functions.values())}];
static const real inertia[{n * n}] = {{{inertia}}};
static const {name}_impedance{suffix} wanted = {{NULL, inertia, NULL, inertia, inertia, 0}};
{bodies}
static void try(const char *name, void (*run)(int), unsigned values)
{{
    paint_stack();
    run(0);
    const uint32_t stack = used_stack(), start = ticks();
    for (int round = 0; round < {REPEATS}; ++round)
        for (int s = 0; s < {SAMPLES}; ++s)
            run(s);
    const uint32_t end = ticks();
    say(name), say(" "), say_number(stack), say(" "), say_number(end - start);
    for (int s = 0; s < {SAMPLES}; ++s) {{
        run(s);
        say(" "), say_bits(out, values * (unsigned)sizeof(real));
    }}
    say("\\n");
}}

int main(void)
{{
{tries}    return 0;
}}
"""


def run(
    directory: Path, board: Board, real: str, motion: Any, functions: dict[str, Call], flags: Any = SMALL
) -> dict[str, Measured]:
    """Build a program of these functions, run it on the board, and return what it says of each."""
    name, dtype = name_of(directory), np.dtype(np.float32 if real == "float" else np.float64)
    source = directory / "c" / f"{name}{'f' if real == 'float' else ''}.c"
    with tempfile.TemporaryDirectory() as folder:
        main, made = Path(folder) / "main.c", Path(folder) / "main.elf"
        main.write_text(program(name, real, motion.astype(dtype), functions), encoding="utf-8")
        including = (f"-I{directory / 'c'}", f"-I{HERE}")
        linking = (
            "-nostartfiles",
            f"-T{HERE / 'board.ld'}",
            "-Wl,--gc-sections",
            "-lm",
            "--specs=nosys.specs",
        )
        sources = (main, HERE / "board.c", source)
        run_kept([*COMPILER, *board.processor, *flags, *including, *sources, *linking], made)
        emulator = [
            "qemu-system-arm",
            "-M",
            board.machine,
            "-nographic",
            "-monitor",
            "none",
            "-serial",
            "none",
        ]
        emulator += ["-semihosting-config", "enable=on,target=native", "-icount", "shift=0"]
        done = subprocess.run(
            [*emulator, "-kernel", str(made)], check=True, capture_output=True, text=True, timeout=120
        )
    return dict(_measured(line, dtype) for line in (done.stdout + done.stderr).splitlines() if line)


def _measured(line: str, dtype: Any) -> tuple[str, Measured]:
    name, stack, ticks, *samples = line.split()
    values = np.array([np.frombuffer(bytes.fromhex(text), dtype) for text in samples])
    return name, Measured(values, int(stack), int(ticks) * TICK // (SAMPLES * REPEATS))


def flash(directory: Path, real: str, board: Board, flags: Any = SMALL) -> int:
    """Bytes of code and constants of all functions of one number type, the math library apart."""
    name = name_of(directory)
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "robot.o"
        source = directory / "c" / f"{name}{'f' if real == 'float' else ''}.c"
        run_kept([*COMPILER, *board.processor, *flags, "-c", source], made)
        sizes = subprocess.run(["arm-none-eabi-size", "-A", made], check=True, capture_output=True, text=True)
    return sum(int(size) for size in re.findall(r"^\.(?:text|rodata)\S* +(\d+)", sizes.stdout, re.M))


SHOWN = ("inverse_dynamics", "propagation", "forward_dynamics", "partial_impedance")


def rows(spec: str, options: Options, kernel: str) -> Iterator[tuple[str, ...]]:
    """Rows of the table for one robot."""
    system = read_system(spec, options)
    n, links = len(system.coordinates), len(system.links)
    functions = {name: call for name, call in calls(n, links).items() if name in SHOWN}
    motion = np.stack(random_states(n, SAMPLES))
    with tempfile.TemporaryDirectory() as folder:
        directory = Path(folder) / system.name
        write_package(generate(system, ["c"], kernel=kernel), directory)
        for processor, real in (("M4F", "float"), ("M7", "double")):
            found = run(directory, BOARDS[processor], real, motion, functions)
            cells = (f"{found[name].stack:,} B, {found[name].instructions:,}" for name in SHOWN)
            size = flash(directory, real, BOARDS[processor])
            yield f"{system.name}, {kernel}", f"{processor}, {real}", f"{size:,} B", *cells


def main() -> None:
    """Print the table."""
    if absent := missing(*TOOLS):
        sys.exit(absent)
    head = ("robot, kernel", "processor, type", "flash", *(f"`{name}`" for name in SHOWN))
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    robots = [("planar3", Options(), "straight")]
    robots += [("puma560", Options(), kernel) for kernel in ("straight", "loops")]
    if PANDA.is_file():
        robots += [(str(PANDA), Options(lock=LOCKED_FINGERS), kernel) for kernel in ("straight", "loops")]
    for robot in robots:
        for row in rows(*robot):
            print(f"| {' | '.join(row)} |")


if __name__ == "__main__":
    main()
