"""Trials in processes of this machine; one that kills its process is told, and stops no other."""

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from types import ModuleType

from linkwise.study.trial_work import TrialOutcome, TrialTask, run_trial

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""What keeps libraries from threads of their own: there is a process for every core."""
DIED = "its process died, as for want of memory; what is special about this log?"


class ProcessPool:
    """An engine of so many processes, one for each core unless given."""

    def __init__(self, workers: int | None = None) -> None:
        self.workers = workers or _cores()

    def outcomes(self, tasks: Sequence[TrialTask]) -> Generator[TrialOutcome]:
        """Outcomes of all tasks, as they come; what is at work ends when nobody wants them any more."""
        waiting = list(reversed(tasks))
        while waiting:
            lost: list[TrialTask] = []
            yield from self._until_one_dies(waiting, lost, self.workers)
            for task in lost:  # one of them is the cause: each by itself
                died: list[TrialTask] = []
                yield from self._until_one_dies([task], died, 1)
                if died:
                    yield TrialOutcome(task.trial.name, reason=DIED)

    def _until_one_dies(
        self, waiting: list[TrialTask], lost: list[TrialTask], workers: int
    ) -> Iterator[TrialOutcome]:
        """Work on what is waiting, from its end; those that were in work when a process died are lost."""
        running: dict[Future[TrialOutcome], TrialTask] = {}
        with _processes(workers) as pool:
            while waiting or running:
                while waiting and len(running) < workers:
                    task = waiting.pop()
                    try:
                        with _born_apart():
                            running[pool.submit(run_trial, task)] = task
                    except BrokenProcessPool:  # one died just now, while none was waited for
                        waiting.append(task)
                        lost += running.values()
                        return
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    try:
                        yield future.result()
                    except BrokenProcessPool:
                        lost += running.values()
                        return
                    del running[future]


@contextmanager
def _processes(count: int) -> Iterator[ProcessPoolExecutor]:
    """So many processes, which are ended in the midst of their work where this one is."""
    before = set(multiprocessing.active_children())
    with ProcessPoolExecutor(count, multiprocessing.get_context("spawn"), _end_with_parent) as pool:
        try:
            yield pool
        except BaseException:
            for child in set(multiprocessing.active_children()) - before:
                child.terminate()
            raise


def _end_with_parent() -> None:
    """In a process: end when the one that began it does, however that ends; it would wait for ever."""
    if (parent := multiprocessing.parent_process()) is not None:

        def watch() -> None:
            parent.join()
            os._exit(1)

        threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _born_apart() -> Iterator[None]:
    """Have processes that begin here know nothing of Ctrl-C, which is this one's matter, nor of its program.

    A process would run a user's script again that has no `if __name__ == "__main__"`, and needs none of it.
    """
    main, sys.modules["__main__"] = sys.modules["__main__"], ModuleType("__main__")
    is_main = threading.current_thread() is threading.main_thread()  # which alone may speak of signals
    former = signal.signal(signal.SIGINT, signal.SIG_IGN) if is_main else None
    unset = [name for name in ONE_THREAD if name not in os.environ]
    os.environ.update(dict.fromkeys(unset, "1"))
    try:
        yield
    finally:
        for name in unset:
            del os.environ[name]
        sys.modules["__main__"] = main
        if former is not None:
            signal.signal(signal.SIGINT, former)


def _cores() -> int:
    """Cores that this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1
