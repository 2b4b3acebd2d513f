"""Running a compiler: several at a time, never for ever, and a terminal is told of the wait."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress

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


def run_all(commands: Sequence[Sequence[str]], tell: Tell) -> None:
    """Run commands side by side; raises RuntimeError, in one line, for one that fails or hangs."""
    running: list[subprocess.Popen[bytes]] = []
    complaints: dict[int, bytes] = {}
    try:
        for command in commands:
            running.append(_started(command))
        _wait(running, complaints, commands[0][0], tell)
    finally:
        for number, process in enumerate(running):
            if number not in complaints:
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)  # with whatever it has started
                process.wait()
                process.stderr.close()  # type: ignore[union-attr]
    for number, (process, command) in enumerate(zip(running, commands, strict=True)):
        if process.returncode:
            reason = _reason(complaints[number], process.returncode)
            raise RuntimeError(f"{command[0]} failed: {reason}; the other back ends need no compiler")


def _started(command: Sequence[str]) -> "subprocess.Popen[bytes]":
    try:
        return subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
    except OSError as error:
        raise RuntimeError(
            f"{command[0]} cannot be run: {error.strerror}; point CC to a C compiler"
        ) from None


def _wait(
    running: "Sequence[subprocess.Popen[bytes]]", complaints: dict[int, bytes], name: str, tell: Tell
) -> None:
    """Fill `complaints` with what each says on stderr until it ends."""
    start = time.monotonic()
    while left := [number for number in range(len(running)) if number not in complaints]:
        seconds = time.monotonic() - start
        if seconds > PATIENCE:
            raise RuntimeError(f"{name} is not done after {PATIENCE:.0f} s; point CC to another C compiler")
        tell(f"{len(complaints)} of {len(running)} parts, {seconds:.0f} s")
        for number in left:
            with suppress(subprocess.TimeoutExpired):
                complaints[number] = running[number].communicate(timeout=min(1.0, PATIENCE) / len(left))[1]


def _reason(complaint: bytes, code: int) -> str:
    """A compiler's first complaint, as one line."""
    lines = complaint.decode(errors="replace").splitlines()
    telling = (line for line in lines if re.search("error|fail|no space", line, re.IGNORECASE))
    said = " ".join(next(telling, " ".join(lines)).split())[:200]
    return said or (f"exit status {code}" if code > 0 else f"it was ended by {signal.Signals(-code).name}")
