"""Trials on a Ray cluster: the same work, on any node that has a core free.

Anyone who reaches a cluster can run code on it. A cluster started here is for this machine alone, so it
listens on the loopback interface and on no other.
"""

import os
import socket
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from ipaddress import ip_address
from typing import Any

from linkwise.errors import LinkwiseError
from linkwise.extras import extra
from linkwise.study.trial import TrialOutcome, TrialTask, run_trial

RETRIES = 3
"""Number of times that a trial is restarted after its worker or node died."""
AHEAD = 4
"""Trials handed out for each core, so that no core waits for work."""
OWN = "local"
"""Ray's name for a new cluster, whatever others run."""
JOINED = "RAY_ADDRESS"
"""Ray's variable for the address of the cluster to use where none is given."""
MANY_MACHINES = "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"
"""Ray's variable, read at its import; at 0 its processes listen on loopback, as on Windows and macOS."""


class RayCluster:
    """An engine of all cores of a cluster: the one at `address`, or else one of this machine alone.

    address: HOST:PORT, "auto" for one that runs on this machine; the value of RAY_ADDRESS if not given
    """

    def __init__(self, address: str | None = None) -> None:
        self._address = address or os.environ.get(JOINED) or OWN
        with self._kept_here():
            self._ray: Any = extra("ray")
        _require_answer(self._address)

    def outcomes(self, tasks: Sequence[TrialTask]) -> Generator[TrialOutcome]:
        """Yield the outcomes of all tasks as they come.

        Raises LinkwiseError where there is no cluster, and where Ray would listen beyond this machine.
        """
        ray = self._ray
        if not ray.is_initialized():
            self._join()
        remote = ray.remote(num_cpus=1, max_retries=RETRIES)(run_trial)
        most = AHEAD * max(1, int(ray.cluster_resources().get("CPU", 1)))
        waiting, running = list(reversed(tasks)), dict[Any, TrialTask]()
        try:
            while waiting or running:
                while waiting and len(running) < most:
                    task = waiting.pop()
                    running[remote.remote(task)] = task
                (done, *_), _ = ray.wait(list(running), num_returns=1)
                task = running.pop(done)
                try:
                    yield ray.get(done)
                except ray.exceptions.RayError as error:
                    reason = str(error).strip().partition("\n")[0]
                    yield TrialOutcome(
                        task.trial.name, reason=f"its worker died {RETRIES + 1} times: {reason}"
                    )
        finally:
            for unwanted in running:
                ray.cancel(unwanted, force=True)

    def _join(self) -> None:
        ray, is_own = self._ray, self._address == OWN
        if is_own and not ip_address(ray.util.get_node_ip_address()).is_loopback:
            raise LinkwiseError(
                "Ray was imported before the RayCluster was made, and would listen to other machines; make it"
                " before, or call ray.init yourself"
            )
        with self._kept_here():
            try:
                ray.init(self._address, log_to_driver=False, include_dashboard=False if is_own else None)
            except (ConnectionError, ValueError, RuntimeError) as error:
                raise LinkwiseError(f"no cluster of Ray at {self._address}: {error}") from error

    @contextmanager
    def _kept_here(self) -> Iterator[None]:
        """Keep Ray, and what it starts, on this machine if the cluster is for this machine alone."""
        former = os.environ.get(MANY_MACHINES)
        if self._address == OWN:
            os.environ[MANY_MACHINES] = "0"
        try:
            yield
        finally:
            os.environ.pop(MANY_MACHINES, None)
            if former is not None:
                os.environ[MANY_MACHINES] = former


def _require_answer(address: str) -> None:
    """Raise LinkwiseError where nothing listens at HOST:PORT; Ray would wait for minutes."""
    host, sign, port = address.rpartition("://")[2].rpartition(":")
    if not sign:  # "auto" or "local"
        return
    try:
        socket.create_connection((host, int(port)), timeout=10).close()
    except (OSError, ValueError) as error:
        raise LinkwiseError(f"--address {address}: no cluster of Ray answers there: {error}") from error
