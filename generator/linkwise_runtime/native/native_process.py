"""Runs a compiler: several commands at a time, with a time limit, and progress on a terminal."""

import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import IO, cast

from .native_system import system_here

PATIENCE = 3600.0
"""Seconds after which a compiler counts as hung; the largest robots take minutes."""
WIDTH = 79

STEP = 0.1
"""Seconds between two checks of the running programs."""

Tell = Callable[[str], None]
"""Function that is called with the progress, in words."""


@contextmanager
def told(what: str) -> Iterator[Tell]:
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
    running: list[_Running] = []
    try:
        for command in commands:
            running.append(_started(command, "stderr"))
        if not _ended(running, PATIENCE, tell):
            name = commands[0][0]
            raise RuntimeError(f"{name} is not done after {PATIENCE:.0f} s; point CC to another C compiler")
    finally:
        for one in running:
            one.close()
    for one, command in zip(running, commands, strict=True):
        if one.process.returncode:
            reason = _reason(bytes(one.said), one.process.returncode)
            raise RuntimeError(f"{command[0]} failed: {reason}")


def answer(command: Sequence[str], seconds: float) -> bytes:
    """Return a command's stdout; raise RuntimeError if it cannot run or does not end in so many seconds."""
    one = _started(command, "stdout")
    try:
        if not _ended([one], seconds, lambda _: None):
            raise RuntimeError(
                f"{' '.join(command)} gives no answer in {seconds:.0f} s; point CC to a C compiler"
            )
    finally:
        one.close()
    return bytes(one.said)


@dataclass(frozen=True)
class _Running:
    """A program that is listened to until it ends itself, not until all programs that it started have ended.

    A compiler's wrapper may leave a server behind, which keeps the same stdout and stderr open for hours.
    """

    process: "subprocess.Popen[bytes]"
    stream: IO[bytes]
    said: bytearray

    def has_ended(self) -> bool:
        """Return whether the program has ended; add what it has written so far to `said`."""
        ended = self.process.poll() is not None  # asked first: what it wrote before its end can then be read
        system_here().hear(self.stream, self.said, ended)
        return ended

    def close(self) -> None:
        """End the program, and all that it started, if it still runs."""
        if self.process.poll() is None:
            system_here().stop(self.process)
            self.process.wait()
        self.stream.close()


def _started(command: Sequence[str], listened: str) -> _Running:
    """Start a command and listen to its stdout or its stderr."""
    system = system_here()
    try:
        outlet = system.outlet()
        process = subprocess.Popen(
            command,
            bufsize=0,
            stdin=subprocess.DEVNULL,
            stdout=outlet if listened == "stdout" else subprocess.DEVNULL,
            stderr=outlet if listened == "stderr" else subprocess.DEVNULL,
            start_new_session=True,
        )
    except OSError as error:
        raise RuntimeError(
            f"{command[0]} cannot be run: {error.strerror}; point CC to a C compiler"
        ) from None
    stream = cast("IO[bytes]", getattr(process, listened) or outlet)
    system.listen(stream)
    return _Running(process, stream, bytearray())


def _ended(running: Sequence[_Running], patience: float, tell: Tell) -> bool:
    """Wait until all have ended; return False if that takes longer than `patience` seconds."""
    start = time.monotonic()
    while left := [one for one in running if not one.has_ended()]:
        seconds = time.monotonic() - start
        if seconds > patience:
            return False
        tell(f"{len(running) - len(left)} of {len(running)} parts, {seconds:.0f} s")
        with suppress(subprocess.TimeoutExpired):
            left[0].process.wait(STEP)
    return True


def _reason(complaint: bytes, code: int) -> str:
    """Return a compiler's first error message, as one line."""
    lines = complaint.decode(errors="replace").splitlines()
    telling = (line for line in lines if re.search("error|fail|no space", line, re.IGNORECASE))
    said = " ".join(next(telling, " ".join(lines)).split())[:200]
    return said or (f"exit status {code}" if code > 0 else f"it was ended by {signal.Signals(-code).name}")
