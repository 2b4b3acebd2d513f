"""OpenSim itself, asked in a process of its own, which a fault of its compiled code may end."""

import os
import tempfile
from collections.abc import Callable
from typing import IO, Any, TypeVar

from linkwise.errors import LinkwiseError
from linkwise.extras import extra
from linkwise.own_process import Ended, ProcessLimits, in_own_process

T = TypeVar("T")

FAULT = "[error]"
"""Beginning of the lines in which OpenSim says what is wrong, where its exception refers to them."""


def asked_of_opensim(
    work: Callable[[Any], T], who: str = "OpenSim", limits: ProcessLimits | None = None
) -> T:
    """Return what `work` makes of the module opensim, in a process of its own.

    who: who is asked, for what, as messages begin

    Raises LinkwiseError where OpenSim is not installed, with how to install it, and where it fails.
    """
    try:
        return in_own_process(lambda: _silently(work), limits)
    except (Ended, RuntimeError, MemoryError) as error:
        raise LinkwiseError(f"{who} fails: {' '.join(str(error).split())}") from None


def _silently(work: Callable[[Any], T]) -> T:
    """Return what `work` makes of OpenSim, whose tools print on standard output.

    Raises RuntimeError with what OpenSim printed of a fault, beside what it raised.
    """
    output = os.dup(1)
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as printed:
        os.dup2(printed.fileno(), 1)
        try:
            return work(_quiet())
        except RuntimeError as error:
            raise RuntimeError(f"{error} {_faults(printed)}") from None
        finally:
            os.dup2(output, 1)
            os.close(output)


def _faults(printed: IO[str]) -> str:
    printed.seek(0)
    return " ".join(printed.read().partition(FAULT)[2].replace(FAULT, "").split())


def _quiet() -> Any:
    osim = extra("opensim")
    osim.Logger.removeFileSink()  # it would write opensim.log into the working directory
    osim.Logger.setLevelString("Error")
    return osim
