"""Endings of a command that cannot go on: one printable line on stderr, and an exit status."""

import os
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from linkwise.errors import LinkwiseError
from linkwise.escape import one_line, short

MISTAKE = 2
"""Exit status where the input, an option or the system stands in the way: the user can fix it."""
FAULT = 70
"""Exit status of a fault of linkwise itself, as sysexits.h numbers it."""
INTERRUPTED, CLOSED_PIPE = 130, 141
"""Exit statuses with which a shell reports a program that the signals SIGINT and SIGPIPE ended."""
TRACEBACK = "LINKWISE_TRACEBACK"
"""Environment variable that, set to 1, adds the traceback of whatever ends a command."""
LONGEST_LINE = 1000
"""Most characters of a message; lists are shortened where they are made, so hardly any comes near."""


@contextmanager
def ended_in_one_line() -> Iterator[None]:
    """Turn an exception that is raised inside into a line on stderr and SystemExit."""
    try:
        yield
        sys.stdout.flush()  # a full disk or a closed pipe shows here, and not after the end
    except (Exception, KeyboardInterrupt) as error:
        if isinstance(error, BrokenPipeError):
            _let_go_of_output()
            sys.exit(CLOSED_PIPE)  # whoever reads has enough: nothing to be said
        if os.environ.get(TRACEBACK) == "1":
            traceback.print_exception(error)
        message, status = ending(error)
        with suppress(OSError):  # a full disk: the status tells it all the same
            print(f"linkwise: {one_line(message, LONGEST_LINE)}", file=sys.stderr)
        _let_go_of_output()
        sys.exit(status)


def _let_go_of_output() -> None:
    """Print what waits; where that fails, send it nowhere, as Python would try again at its end."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream.fileno())
            os.close(nowhere)


def ending(error: BaseException) -> tuple[str, int]:
    """Return the message for an error, and the exit status."""
    match error:
        case LinkwiseError():
            return f"error: {error}", MISTAKE
        case KeyboardInterrupt():
            return "interrupted", INTERRUPTED
        case MemoryError():
            return "error: there is not enough memory for this; give a smaller input", MISTAKE
        case OSError(strerror=str() as reason):
            return f"error: {error.filename or 'standard output'}: {reason}", MISTAKE
    return (
        f"fault: {type(error).__name__}{_place(error)}: {short(str(error), 300)}; this is a fault of"
        f" linkwise, not of your input: please report it, with the traceback that {TRACEBACK}=1 shows",
        FAULT,
    )


def _place(error: BaseException) -> str:
    """Return the file and line in linkwise that an error came from, in words; empty for none."""
    home = Path(__file__).parents[1]
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        path = Path(frame.filename)
        if path.is_relative_to(home):
            return f" ({path.relative_to(home).as_posix()}, line {frame.lineno})"
    return ""
