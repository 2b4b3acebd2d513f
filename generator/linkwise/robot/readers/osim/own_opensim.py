"""OpenSim itself, asked in a process of its own, which a fault of its compiled code may end."""

import os
from collections.abc import Callable
from typing import Any, TypeVar

from linkwise.errors import LinkwiseError
from linkwise.extras import extra
from linkwise.own_process import Ended, in_own_process

T = TypeVar("T")


def asked_of_opensim(work: Callable[[Any], T], what: str) -> T:
    """Return what `work` makes of the module opensim, in a process of its own.

    what: what is asked, as messages begin

    Raises LinkwiseError where OpenSim is not installed, with how to install it, and where it fails.
    """
    try:
        return in_own_process(lambda: _silently(work))
    except (Ended, RuntimeError, MemoryError) as error:
        raise LinkwiseError(f"{what}: OpenSim fails: {' '.join(str(error).split())}") from None


def _silently(work: Callable[[Any], T]) -> T:
    """Return what `work` makes of OpenSim, whose tools print what they do on standard output."""
    nowhere, output = os.open(os.devnull, os.O_WRONLY), os.dup(1)
    os.dup2(nowhere, 1)
    try:
        return work(_quiet())
    finally:
        os.dup2(output, 1)
        os.close(output)
        os.close(nowhere)


def _quiet() -> Any:
    osim = extra("opensim")
    osim.Logger.removeFileSink()  # it would write opensim.log into the working directory
    osim.Logger.setLevelString("Off")
    return osim
