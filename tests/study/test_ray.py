"""Studies on a cluster of Ray: two nodes on this machine, one of whose workers is killed in the middle."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from helpers.studies import CHOICES, HEAD, QUICK, TRIALS, write_study

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


LISTENING = """
import os
from pathlib import Path
from linkwise.study import RayCluster

before = dict(os.environ)
assert list(RayCluster().outcomes(())) == []
assert {name: os.environ.get(name) for name in before} == before
assert "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER" not in os.environ
parents = {int(stat.parent.name): int(stat.read_text().rpartition(")")[2].split()[1])
           for stat in Path("/proc").glob("[0-9]*/stat") if stat.exists()}

def is_ours(pid):
    return pid == os.getpid() or pid in parents and is_ours(parents[pid])

sockets = {os.readlink(file) for pid in filter(is_ours, parents) for file in Path(f"/proc/{pid}/fd").glob("*")
           if os.path.lexists(file)}
for table in ("tcp", "tcp6"):
    for row in Path(f"/proc/net/{table}").read_text().splitlines()[1:]:
        columns = row.split()
        if columns[3] == "0A" and f"socket:[{columns[9]}]" in sockets:
            print(columns[1].partition(":")[0])
"""
"""Begins a cluster, and prints the addresses that its processes listen at, as Linux writes them."""


@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")
def test_a_cluster_of_this_machine_is_heard_by_no_other() -> None:
    environment = os.environ | {"RAY_USAGE_STATS_ENABLED": "0"}
    environment.pop("RAY_ADDRESS", None)
    command = [sys.executable, "-c", LISTENING]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    found = set(done.stdout.split())
    assert found
    assert found <= {"0100007F", "0000000000000000FFFF00000100007F", "00000000000000000000000001000000"}


def test_a_ray_that_would_listen_to_other_machines_is_not_begun(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("RAY_ADDRESS", raising=False)
    with pytest.raises(LinkwiseError, match=r"^Ray was imported before .* call ray\.init yourself$"):
        next(RayCluster().outcomes(()))
    assert not ray.is_initialized()


def test_a_cluster_that_does_not_answer_is_told_at_once() -> None:
    with pytest.raises(LinkwiseError, match=r"--address 127\.0\.0\.1:1: no cluster of Ray answers there"):
        RayCluster("127.0.0.1:1")
