"""Trials on a cluster of Ray: the same work, on whatever node has a core free."""

import socket
from collections.abc import Generator, Sequence
from typing import Any

from linkwise.errors import LinkwiseError
from linkwise.extras import extra
from linkwise.study.trial_work import TrialOutcome, TrialTask, run_trial

RETRIES = 3
"""How often a trial is begun anew whose worker or node died."""
AHEAD = 4
"""Trials handed out for each core, so that none waits for work."""


class RayCluster:
    """An engine of all cores of a cluster: the one at `address`, else one that runs, else this machine."""

    def __init__(self, address: str | None = None) -> None:
        self._ray: Any = extra("ray")
        self._address = address
        _require_answer(address)

    def outcomes(self, tasks: Sequence[TrialTask]) -> Generator[TrialOutcome]:
        """Outcomes of all tasks, as they come. Raises LinkwiseError where no cluster is."""
        ray = self._ray
        if not ray.is_initialized():
            try:
                ray.init(
                    address=self._address,
                    log_to_driver=False,
                    include_dashboard=False if not self._address else None,
                )
            except (ConnectionError, ValueError, RuntimeError) as error:
                raise LinkwiseError(f"no cluster of Ray at {self._address}: {error}") from error
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


def _require_answer(address: str | None) -> None:
    """Raise LinkwiseError where nothing listens at HOST:PORT, for which Ray would wait for minutes."""
    host, sign, port = (address or "").rpartition("://")[2].rpartition(":")
    if not sign:  # "auto", or none
        return
    try:
        socket.create_connection((host, int(port)), timeout=10).close()
    except (OSError, ValueError) as error:
        raise LinkwiseError(f"--address {address}: no cluster of Ray answers there: {error}") from error
