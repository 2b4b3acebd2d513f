"""Work apart: its answer and its errors come back, and it ends when its limits or this process say so."""

import mmap
import os
import signal
import time
import warnings
from types import FrameType

import pytest
from linkwise.errors import LinkwiseError
from linkwise.own_process import Ended, OutOfTime, ProcessLimits, in_own_process

LIMITS = ProcessLimits(seconds=1, memory=64 << 20)


def fail() -> None:
    raise LinkwiseError("so it is")


def turn() -> None:
    while True:
        pass


def test_answers_and_errors_come_back() -> None:
    assert in_own_process(lambda: os.getpid()) != os.getpid()
    with pytest.raises(LinkwiseError, match="so it is"):
        in_own_process(fail, LIMITS)
    with pytest.raises(Ended, match="by SIGABRT"):
        in_own_process(os.abort, LIMITS)


def test_what_a_library_says_of_its_end_is_told_by_nobody_else(capfd: pytest.CaptureFixture[str]) -> None:
    in_own_process(lambda: (os.write(1, b"answer"), os.write(2, b"terminate called")), LIMITS)
    assert capfd.readouterr() == ("answer", "")


def mapped(size: int) -> int:
    """Take memory of the system's, past what malloc has."""
    return len(mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS))


def test_limits_are_of_what_the_work_takes_itself() -> None:
    held = bytearray(256 << 20)
    assert in_own_process(lambda: len(bytearray(16 << 20)), LIMITS) == 16 << 20
    assert in_own_process(lambda: mapped(48 << 20), LIMITS) == 48 << 20
    with pytest.raises(OSError, match="Cannot allocate memory"):
        in_own_process(lambda: mapped(72 << 20), LIMITS)
    with pytest.raises(MemoryError):  # of more than malloc may have kept of what this process freed before
        in_own_process(lambda: len(bytearray(2 << 30)), LIMITS)
    with pytest.raises(OutOfTime, match="it took more than 1 s"):
        in_own_process(turn, LIMITS)
    assert len(held) == 256 << 20


def test_forks_beside_threads_of_others_are_no_matter_for_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    fork = os.fork

    def warning() -> int:
        warnings.warn("this process has threads", DeprecationWarning, stacklevel=2)  # as from Python 3.12 on
        return fork()

    monkeypatch.setattr(os, "fork", warning)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert in_own_process(lambda: 3) == 3


def test_an_interrupt_ends_the_work_too(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[int] = []
    fork = os.fork
    monkeypatch.setattr(os, "fork", lambda: begun.append(fork()) or begun[-1])

    def interrupt(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, 0.2)
    start = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            in_own_process(lambda: time.sleep(60))
    finally:
        signal.signal(signal.SIGALRM, before)
    assert time.monotonic() - start < 20
    with pytest.raises(ChildProcessError):  # and it is not left
        os.waitpid(begun[0], os.WNOHANG)
