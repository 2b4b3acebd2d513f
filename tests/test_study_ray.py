"""Studies on a cluster of Ray: two nodes on this machine, one of whose workers is killed in the middle."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from studies import CHOICES, HEAD, QUICK, TRIALS, write_study

pytest.importorskip("ray", reason="needs ray: pip install 'linkwise[ray]'")

import pandas as pd
import ray
from linkwise import LinkwiseError
from linkwise.study import RayCluster, run_study
from ray.cluster_utils import Cluster


@pytest.fixture
def nodes(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "object_store_memory": 100 << 20})
    cluster.add_node(num_cpus=1, object_store_memory=100 << 20)
    yield cluster
    ray.shutdown()
    cluster.shutdown()


def workers() -> list[int]:
    """Processes that work on a trial now."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                title = (entry / "cmdline").read_bytes()
            except OSError:
                continue
            if title.startswith(b"ray::run_trial"):
                found.append(int(entry.name))
    return found


def test_every_trial_is_there_once_though_a_worker_dies(nodes: Any, tmp_path: Path) -> None:
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=3)
    killed: list[int] = []

    def kill_one(stage: str, done: int, whole: int) -> None:
        if stage == "trials" and done == 3 and not killed:
            while not (there := workers()):
                pass
            killed.append(there[0])
            os.kill(there[0], signal.SIGKILL)

    found = run_study(file, tmp_path / "out", RayCluster(nodes.address), kill_one)
    assert len(killed) == 1
    assert (len(found.done), found.broken) == (12, ())
    counts = pd.read_parquet(tmp_path / "out/trials").groupby("trial", observed=True).size()
    assert len(counts) == 12
    assert set(counts) == {300}


def test_a_cluster_that_does_not_answer_is_told_at_once() -> None:
    with pytest.raises(LinkwiseError, match=r"--address 127\.0\.0\.1:1: no cluster of Ray answers there"):
        RayCluster("127.0.0.1:1")
