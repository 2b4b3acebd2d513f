"""`python -m linkwise`, and the script `linkwise`."""

import os
import signal
import sys
import threading
import time
from types import FrameType

from linkwise.own_runtime import require_own_runtime

OVERDUE = 10.0
"""Seconds after which an interrupted command should have ended, also where others use the machine."""
SOON = 0.02
"""Seconds after which an interrupt comes again that met a finaliser, where Python would lose it."""


def main() -> None:
    """Run the command line; an interrupt while it is being imported ends it as a later one does."""
    _open_closed()
    _heed_one_interrupt()
    try:
        require_own_runtime()
    except ImportError as error:
        print(f"linkwise: error: {error}", file=sys.stderr)
        sys.exit(2)
    try:
        from linkwise.cli.app import main as run
    except KeyboardInterrupt:
        print("linkwise: interrupted", file=sys.stderr)
        sys.exit(130)
    run()


def _heed_one_interrupt() -> None:
    """Let the first Ctrl-C decide: others, while all is tidied up, would break that off, with tracebacks.

    Where a library has swallowed it, another one counts again when the end is overdue. A program that was
    started with Ctrl-C ignored, or with a handler of its own, keeps that.
    """
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        return
    overdue = 0.0

    def interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal overdue
        if time.monotonic() < overdue:
            return
        if _finalises(frame):
            threading.Timer(SOON, _to_main_thread, (number,)).start()
            return
        overdue = time.monotonic() + OVERDUE
        signal.default_int_handler(number, frame)

    signal.signal(signal.SIGINT, interrupt)


def _to_main_thread(number: int) -> None:
    """Send a signal to the main thread, which may be waiting for something."""
    main_thread = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and main_thread is not None:
        signal.pthread_kill(main_thread, number)
    else:
        signal.raise_signal(number)


def _finalises(frame: FrameType | None) -> bool:
    """Return whether an object is being deleted: what is raised there is printed, and lost."""
    while frame is not None and frame.f_code.co_name != "__del__":
        frame = frame.f_back
    return frame is not None


def _open_closed() -> None:
    """Open streams that the caller closed to nowhere: a file opened later would get their numbers.

    Python has None for them, and prints what is meant for stderr to stdout.
    """
    closed = [(k, name) for k, name in enumerate(("stdin", "stdout", "stderr")) if getattr(sys, name) is None]
    for number, _ in closed:
        try:
            os.fstat(number)
        except OSError:
            # A file gets the lowest free number, this one; compilers and workers print there, too.
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
    for number, name in closed:
        setattr(sys, name, open(os.devnull, "w" if number else "r", encoding="utf-8"))  # noqa: SIM115


if __name__ == "__main__":
    main()
