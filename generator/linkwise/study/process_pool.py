"""Trials in processes of this machine; a trial that kills its process twice is reported and stops no other.

A process may die through no fault of its trial: somebody ended it, or memory was short for a while. So each
trial is tried once more, after all others, and no more often, as it may be the trial that takes the memory.

Each process has a pipe of its own and shares nothing with the others: no lock dies with one of them, and a
process that ends at any instant leaves nobody waiting. `concurrent.futures` keeps one queue for all, and
takes a process's exit after a signal for a result. loky ends all processes where one dies, leaves them
running where this one is killed, and ends them by a program, pgrep, which may be missing.
"""

import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from types import ModuleType

from linkwise.analysis.worker_threads import cores
from linkwise.output.workplace import ENDING, signals_held
from linkwise.study.trial import TrialOutcome, TrialTask, run_trial

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Variables that keep libraries from threads of their own: there is a process for every core."""
DIED = "its process died twice, as for want of memory; what is special about this log?"
TIDYING = 3.0
"""Seconds in which a process that is told to end removes its half-written files."""


class ProcessPool:
    """An engine of `workers` processes, one for each core unless given."""

    def __init__(self, workers: int | None = None) -> None:
        self.workers = workers or cores()

    def outcomes(self, tasks: Sequence[TrialTask]) -> Generator[TrialOutcome]:
        """Yield the outcomes of all tasks as they come; end running trials once the caller stops asking."""
        waiting, workers, again = list(reversed(tasks)), list[_Worker](), set[str]()
        if sys.platform != "win32":
            resource_tracker.ensure_running()  # its first start lets signals pass, so not below
        try:
            while waiting or workers:
                while waiting and len(workers) < self.workers:
                    with signals_held():  # a signal that comes now ends this one too
                        workers.append(_Worker())
                    workers[-1].give(waiting.pop())
                ready = wait([worker.pipe for worker in workers])
                for worker in [one for one in workers if one.pipe in ready]:
                    outcome, task = worker.outcome(), worker.at_hand
                    if outcome is not None:
                        yield outcome
                    elif task.trial.name in again:
                        yield TrialOutcome(task.trial.name, reason=DIED)
                    else:
                        again.add(task.trial.name)
                        waiting.insert(0, task)
                    if waiting and worker.process.is_alive():
                        worker.give(waiting.pop())
                    else:
                        workers.remove(worker)
                        _end([worker])
        finally:
            _end(workers)


class _Worker:
    """A process that runs one trial after another."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_work, args=(theirs,), daemon=True)
        with _child_environment():
            self.process.start()
        theirs.close()  # so that the pipe ends when the process does

    def give(self, task: TrialTask) -> None:
        self.at_hand = task
        with suppress(OSError):  # the process is dead, as its outcome shows
            self.pipe.send(task)

    def outcome(self) -> TrialOutcome | None:
        """Return the outcome of the current trial; None if the process died."""
        try:
            outcome: TrialOutcome = self.pipe.recv()
        except (EOFError, OSError):
            _end([self])
            return None
        return outcome


def _end(workers: Sequence[_Worker]) -> None:
    """End processes, even in the middle of their work; kill those that do not tidy up in time."""
    for worker in workers:
        worker.process.terminate()
    until = time.monotonic() + TIDYING
    for worker in workers:
        worker.process.join(max(0.0, until - time.monotonic()))
        worker.process.kill()
        worker.process.join()
        worker.pipe.close()


def _work(tasks: Connection) -> None:
    """Run trials as they come, in the worker's process, until it is told to end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT, *ENDING})
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with suppress(EOFError, OSError):  # the pipe's other end is gone; a trial reports its own
        while True:
            tasks.send(run_trial(tasks.recv()))


def _end_with_parent() -> None:
    """End this process when its parent ends, however that ends, without another trial."""
    if (parent := multiprocessing.parent_process()) is not None:
        parent.join()
        os._exit(1)


@contextmanager
def _child_environment() -> Iterator[None]:
    """Start processes that know nothing of this one's main program, and keep to one thread.

    A process would run a user's script again that has no `if __name__ == "__main__"`, and needs none of it.
    """
    main, sys.modules["__main__"] = sys.modules["__main__"], ModuleType("__main__")
    unset = [name for name in ONE_THREAD if name not in os.environ]
    os.environ.update(dict.fromkeys(unset, "1"))
    try:
        yield
    finally:
        for name in unset:
            del os.environ[name]
        sys.modules["__main__"] = main
