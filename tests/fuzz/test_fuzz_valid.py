"""Random logs and manifests that are right read back as they were written."""

import json
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from linkwise import Options, generate, read_system, write_package
from linkwise.analysis.logs import open_log
from linkwise.package.manifest import Manifest

from fuzz.valid_logs import random_log
from fuzz.valid_robots import random_robot

SAME_EACH_TIME: dict[str, Any] = {"derandomize": True, "deadline": None, "database": None}
RANDOM = st.randoms(use_true_random=False)


@settings(max_examples=150, suppress_health_check=list(HealthCheck), **SAME_EACH_TIME)
@given(RANDOM)
def test_a_log_reads_back_exactly(rng: Random) -> None:
    log = random_log(rng)
    with TemporaryDirectory() as folder:
        path = Path(folder) / log.name
        path.write_bytes(log.content)
        opened = open_log(path)
        assert opened.columns == log.columns
        blocks = [block for block, _ in opened.read(range(len(log.columns)), rows=7)]
    np.testing.assert_array_equal(np.concatenate(blocks), log.table)


@settings(max_examples=10, suppress_health_check=list(HealthCheck), **SAME_EACH_TIME)
@given(RANDOM)
def test_a_manifest_reads_back_exactly(rng: Random) -> None:
    robot = random_robot(rng, rng.randint(1, 3), 5)
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"robot.{robot.form}"
        path.write_text(robot.text, encoding="utf-8")
        files = generate(read_system(path, Options(allow_unphysical=True)), ["numpy"], "robot")
        write_package(files, Path(folder) / "robot")
        manifest = Manifest.read(Path(folder) / "robot")
    assert manifest.text() == files["manifest.json"]
    assert set(manifest.files) == files.keys() - {"manifest.json"}
    assert json.loads(files["manifest.json"])["robot"] == "random"
