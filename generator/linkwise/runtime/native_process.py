"""Running a compiler: several at a time, never for ever, and a terminal is told of the wait."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

PATIENCE = 3600.0
"""Seconds after which a compiler counts as hung; the largest robots take minutes."""
WIDTH = 79

Tell = Callable[[str], None]
"""Called with how far something is, in words."""


@contextmanager
def told(what: str) -> Iterator[Tell]:
    """Show `what` is going on, and how far it is, on one line of stderr, if that is a terminal.

    The line is wiped away in the end, so that nothing of it precedes a message.
    """
    shown = sys.stderr is not None and sys.stderr.isatty()

    def show(line: str, end: str = "") -> None:
        if shown:
            print(f"\r{line[:WIDTH]:<{WIDTH}}{end}", end="", file=sys.stderr, flush=True)

    try:
        yield lambda note: show(f"{what}: {note}")
    finally:
        show("", "\r")


def run_all(commands: Sequence[Sequence[str]], folder: Path, tell: Tell) -> None:
    """Run commands side by side; raises RuntimeError, in one line, for one that fails or hangs."""
    running: list[subprocess.Popen[bytes]] = []
    complaints = [folder / f"{number}.txt" for number in range(len(commands))]
    try:
        for command, complaint in zip(commands, complaints, strict=True):
            running.append(_started(command, complaint))
        _wait(running, commands[0][0], tell)
    finally:
        for process in running:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)  # with whatever it has started
                process.wait()
    for process, command, complaint in zip(running, commands, complaints, strict=True):
        if process.returncode:
            raise RuntimeError(
                f"{command[0]} failed: {_reason(complaint, process.returncode)}; "
                "the other back ends need no compiler"
            )


def _started(command: Sequence[str], complaint: Path) -> "subprocess.Popen[bytes]":
    with complaint.open("wb") as errors:
        try:
            return subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=errors,
                start_new_session=True,
            )
        except OSError as error:
            raise RuntimeError(
                f"{command[0]} cannot be run: {error.strerror}; point CC to a C compiler"
            ) from None


def _wait(running: "Sequence[subprocess.Popen[bytes]]", name: str, tell: Tell) -> None:
    start = time.monotonic()
    while left := [process for process in running if process.poll() is None]:
        seconds = time.monotonic() - start
        if seconds > PATIENCE:
            raise RuntimeError(f"{name} is not done after {PATIENCE:.0f} s; point CC to another C compiler")
        tell(f"{len(running) - len(left)} of {len(running)} parts, {seconds:.0f} s")
        with suppress(subprocess.TimeoutExpired):
            left[0].wait(min(1.0, PATIENCE))


def _reason(complaint: Path, code: int) -> str:
    """A compiler's first complaint, as one line."""
    lines = complaint.read_text(encoding="utf-8", errors="replace").splitlines()
    said = next((line for line in lines if "error" in line.lower()), " ".join(lines))
    fallback = f"exit status {code}" if code > 0 else f"it was ended by {signal.Signals(-code).name}"
    return " ".join(said.split())[:200] or fallback
