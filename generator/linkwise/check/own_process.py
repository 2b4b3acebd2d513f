"""Work that a fault of compiled code may end, done in a process of its own."""

import faulthandler
import os
import pickle
import signal
import warnings
from collections.abc import Callable
from typing import TypeVar

from linkwise.runtime.native.native_system import system_here

T = TypeVar("T")


class Ended(Exception):
    """The process ended before it answered; the message says by what."""


def in_own_process(work: Callable[[], T]) -> T:
    """Answer of `work`, from a fork of this process; raises Ended where a signal ends that one.

    What `work` raises comes back too. Where a fork cannot compute, it is done in this process.
    """
    if not system_here().forks:
        return work()
    reader, writer = os.pipe()
    with warnings.catch_warnings():  # `work` computes with NumPy alone, which forks well beside threads
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if not child:
        _answer(work, writer)
    os.close(writer)
    with os.fdopen(reader, "rb") as pipe:
        answer = pipe.read()
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if status < 0:
        raise Ended(f"it ended the process by {signal.Signals(-status).name}")
    if not answer:
        raise Ended("it ended the process")
    succeeded, result = pickle.loads(answer)
    if not succeeded:
        raise result
    return result  # type: ignore[no-any-return]


def _answer(work: Callable[[], T], writer: int) -> None:
    """Write what `work` gives or raises, and end this process without more ado."""
    faulthandler.disable()  # the parent tells by what signal it ended, in a line
    try:
        try:
            answer = pickle.dumps((True, work()))
        except Exception as error:
            answer = pickle.dumps((False, error))
        with os.fdopen(writer, "wb") as pipe:
            pipe.write(answer)
    finally:
        os._exit(0)
