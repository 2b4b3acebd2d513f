"""Runs a compiler: several commands at a time, with a time limit, and progress on a terminal."""

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from typing import IO, Any

from .system import system_here

PATIENCE = 3600.0
"""Seconds after which a compiler counts as hung; the largest robots take minutes."""
WIDTH = 79

STEP = 0.1
"""Seconds between two checks of the running programs."""

Tell = Callable[[str], None]
"""Function that is called with the progress, in words."""


@contextmanager
def shown_on_one_line(what: str) -> Iterator[Tell]:
    """Show on one line of stderr that `what` is going on, and its progress, if stderr is a terminal.

    The line is cleared in the end, so that no message is printed behind it.
    """
    shown = sys.stderr is not None and sys.stderr.isatty()

    def show(line: str, end: str = "") -> None:
        if shown:
            print(f"\r{line[:WIDTH]:<{WIDTH}}{end}", end="", file=sys.stderr, flush=True)

    try:
        yield lambda note: show(f"{what}: {note}")
    finally:
        show("", "\r")


def run_all(commands: Sequence[Sequence[str]], tell: Tell) -> None:
    """Run commands side by side; raise RuntimeError, in one line, for one that fails or hangs.

    `tell` is called with how many have ended.
    """
    with ExitStack() as held:
        running = [held.enter_context(_started(command, "stderr")) for command in commands]
        start = time.monotonic()
        while left := [process for process, _ in running if process.poll() is None]:
            seconds = time.monotonic() - start
            if seconds > PATIENCE:
                name = commands[0][0]
                raise RuntimeError(
                    f"{name} is not done after {PATIENCE:.0f} s; point CC to another C compiler"
                )
            tell(f"{len(running) - len(left)} of {len(running)} parts, {seconds:.0f} s")
            with suppress(subprocess.TimeoutExpired):
                left[0].wait(STEP)
        for (process, said), command in zip(running, commands, strict=True):
            if process.returncode:
                raise RuntimeError(f"{command[0]} failed: {_reason(_read(said), process.returncode)}")


def answer(command: Sequence[str], seconds: float) -> bytes:
    """Return a command's stdout; raise RuntimeError if it cannot run or does not end in so many seconds."""
    with _started(command, "stdout") as (process, said):
        try:
            process.wait(seconds)
        except subprocess.TimeoutExpired:
            told = f"{' '.join(command)} gives no answer in {seconds:.0f} s; point CC to a C compiler"
            raise RuntimeError(told) from None
        return _read(said)


@contextmanager
def _started(command: Sequence[str], heard: str) -> Iterator[tuple["subprocess.Popen[bytes]", IO[bytes]]]:
    """Start a command, and yield it with a file of what it writes to its stdout or its stderr.

    It is ended, with all that it started, if it still runs in the end. `subprocess.run` would read from a
    pipe until all programs have ended that have it open: a compiler's wrapper may leave a server behind.
    """
    with ExitStack() as held:
        try:
            said = held.enter_context(_passing_file())
            outlets: dict[str, Any] = {
                "stdout": subprocess.DEVNULL,
                "stderr": subprocess.DEVNULL,
                heard: said,
            }
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, start_new_session=True, **outlets)
        except OSError as error:
            raise RuntimeError(
                f"{command[0]} cannot be run: {error.strerror}; point CC to a C compiler"
            ) from None
        held.callback(_end, process)
        yield process, said


def _passing_file() -> IO[bytes]:
    """Return a file without a name, in memory where the system can: no disk may be writable."""
    if hasattr(os, "memfd_create"):
        return os.fdopen(os.memfd_create("linkwise"), "w+b")
    return tempfile.TemporaryFile()


def _end(process: "subprocess.Popen[bytes]") -> None:
    if process.poll() is None:
        system_here().stop(process)
        process.wait()


def _read(said: IO[bytes]) -> bytes:
    """Return what a program that has ended has written: before, reading would move where it writes."""
    said.seek(0)
    return said.read()


def _reason(complaint: bytes, code: int) -> str:
    """Return a compiler's first error message, as one line."""
    lines = complaint.decode(errors="replace").splitlines()
    telling = (line for line in lines if re.search("error|fail|no space", line, re.IGNORECASE))
    said = " ".join(next(telling, " ".join(lines)).split())[:200]
    return said or (f"exit status {code}" if code > 0 else f"it was ended by {signal.Signals(-code).name}")
