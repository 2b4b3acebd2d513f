"""Generating a robot's package and compiling its C: what it costs, and what comes out."""

import importlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from speed.cases import Case

PEERS = Path(__file__).parent.parent / "peers"


@dataclass(frozen=True)
class Package:
    """A generated package, its manifest and the libraries that its own loader compiled, by number type."""

    name: str
    directory: Path
    manifest: dict[str, Any]
    libraries: dict[str, Path]
    of_reactions: dict[str, Path]
    """Libraries that have the reactions."""
    sizes: dict[str, int]
    generate_seconds: float
    compile_seconds: dict[str, float]
    code_bytes: int

    @property
    def operations(self) -> int:
        """Additions and multiplications of a full decomposition."""
        return int(self.manifest["operations"])

    @property
    def outputs(self) -> int:
        """Values of one sample."""
        return sum(self.sizes[what] for what in ("C2", "C1", "G", "G"))

    def module(self) -> ModuleType:
        """Return the package itself."""
        return importlib.import_module(self.name)


def prepare(case: Case, work: Path, kernel: str | None = None) -> Package:
    """Generate with all back ends in a process of its own, then compile into an empty cache.

    kernel: what `generate --kernel` is told, if it is
    """
    command = [sys.executable, "-m", "linkwise", "generate", case.robot(work), *case.options]
    command += ["--kernel", kernel] if kernel else []
    start = time.perf_counter()
    subprocess.run([*command, "--name", case.name, "--out", str(work)], check=True, capture_output=True)
    generated = time.perf_counter() - start
    if str(work) not in sys.path:
        sys.path.insert(0, str(work))
    cache = work / "cache" / case.name
    shutil.rmtree(cache, ignore_errors=True)
    os.environ["LINKWISE_CACHE"] = str(cache)
    build = importlib.import_module("linkwise_runtime.native.build")
    directory = work / case.name
    sources = build.Sources(case.name, directory / "c")
    libraries, of_reactions, compiled = {}, {}, {}
    for real in ("double", "float"):
        start = time.perf_counter()
        libraries[real] = build.library(sources, real)
        compiled[real] = time.perf_counter() - start
        of_reactions[real] = build.library(sources, real, "regressors")
    header = (directory / "c" / f"{case.name}.h").read_text(encoding="utf-8")
    sizes = {key: int(value) for key, value in re.findall(rf"{case.name.upper()}_(\w+) = (\d+)", header)}
    manifest = json.loads((directory / "manifest.json").read_text(encoding="utf-8"))
    size = code_size(libraries["double"])
    return Package(case.name, directory, manifest, libraries, of_reactions, sizes, generated, compiled, size)


def code_size(library: Path) -> int:
    """Bytes of machine code and constants."""
    if not shutil.which("size"):
        return library.stat().st_size
    lines = subprocess.run(["size", str(library)], check=True, capture_output=True, text=True).stdout
    return int(lines.splitlines()[1].split()[0])


def build_flags() -> tuple[str, ...]:
    """Return the flags by which peers in C are compiled."""
    return ("-O3", "-march=native")


def compiler() -> str | None:
    """Return a C compiler's name."""
    return next((c for c in ("cc", "gcc", "clang") if shutil.which(c)), None)


def run(command: list[str], given: str | None = None, limit: float | None = None) -> str:
    """Run a program and return what it prints; its complaint goes into the error.

    Past the `limit` in seconds it is ended, with what it started, and subprocess.TimeoutExpired raised.
    """
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, text=True, start_new_session=True, **pipes) as process:
        try:
            printed, complaint = process.communicate(given, timeout=limit)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            raise
    if process.returncode:
        raise RuntimeError(f"{Path(command[0]).name} failed ({process.returncode}): {complaint[:500]}")
    return printed


def pairs(text: str) -> dict[str, float]:
    """Read "name value" lines."""
    return {key: float(value) for key, value in (line.split() for line in text.splitlines())}
