"""Work in a process of its own, where a fault of compiled code may end it, or where it may not end.

`multiprocessing` lets none of its daemons, which a study's workers are, begin a process of its own.
"""

import faulthandler
import os
import pickle
import signal
import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from linkwise_runtime.native.system import system_here

T = TypeVar("T")

ON_THE_CLOCK = 10
"""Seconds of the clock for each of processor time: a machine that many share is so much slower."""


class Ended(Exception):
    """Error where the process ended before it answered; the message says by what."""


class OutOfTime(Ended):
    """Error where the work took more time than it had."""


@dataclass(frozen=True)
class ProcessLimits:
    """Limits of work: s of processor time, and bytes of memory beyond what this process holds."""

    seconds: int
    memory: int


def in_own_process(work: Callable[[], T], limits: ProcessLimits | None = None) -> T:
    """Return the answer of `work`, from a fork of this process; raises Ended where a signal ends that one.

    Whatever `work` raises is raised here too, a MemoryError where it needs more than the limits have. Where a
    fork cannot compute, it is done in this process, without limits.
    """
    return begun(work, limits)()


def begun(work: Callable[[], T], limits: ProcessLimits | None = None) -> Callable[[], T]:
    """Start `work` as `in_own_process` does, and return a call that waits for its answer.

    It is to be called once, and raises as `in_own_process` does.
    """
    if not system_here().forks:
        return work
    reader, writer = os.pipe()
    with warnings.catch_warnings():  # `work` computes with NumPy or MuJoCo alone, which fork beside threads
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if not child:
        _answer(work, writer, limits)
    os.close(writer)
    return lambda: _waited(child, reader, limits)


def _waited(child: int, reader: int, limits: ProcessLimits | None) -> Any:
    try:
        with os.fdopen(reader, "rb") as pipe:
            answer = pipe.read()
    except BaseException:  # above all an interrupt, which compiled code does not heed
        os.kill(child, signal.SIGKILL)
        raise
    finally:
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if limits and -status in (signal.SIGXCPU, signal.SIGALRM):
        raise OutOfTime(f"it took more than {limits.seconds} s")
    if status < 0:
        raise Ended(f"it ended the process by {signal.Signals(-status).name}")
    if not answer:
        raise Ended("it ended the process")
    succeeded, result = pickle.loads(answer)
    if not succeeded:
        raise result
    return result


def _answer(work: Callable[[], T], writer: int, limits: ProcessLimits | None) -> None:
    """Write what `work` gives or raises, and end this process at once."""
    faulthandler.disable()  # the parent tells by what signal it ended, in a line
    try:
        if limits:
            _hold(limits)
        try:
            answer = pickle.dumps((True, work()))
        except Exception as error:
            answer = pickle.dumps((False, error))
        with os.fdopen(writer, "wb") as pipe:
            pipe.write(answer)
    finally:
        os._exit(0)


def _hold(limits: ProcessLimits) -> None:
    """Make the system end this process, or refuse it memory, where it would take more than the limits."""
    import resource  # available wherever forks are

    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # what C++ says of its end; the parent says it in a line
    for number in (signal.SIGXCPU, signal.SIGALRM):
        signal.signal(number, signal.SIG_DFL)
    signal.alarm(ON_THE_CLOCK * limits.seconds)
    most = {resource.RLIMIT_CORE: 0, resource.RLIMIT_CPU: limits.seconds}
    with suppress(OSError):  # no /proc, as on BSD, where the limit would not count mapped memory
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[5])
        most[resource.RLIMIT_DATA] = pages * resource.getpagesize() + limits.memory
    for kind, wanted in most.items():
        hard = resource.getrlimit(kind)[1]
        soft = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
        resource.setrlimit(kind, (soft, hard))
