"""Containerfile and devcontainer.json say what can be done; no container engine is asked."""

import json
import os
import re
import shlex
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from helpers.installation import ROOT, empty_environment, run
from linkwise import generate, read_system, write_package
from packaging.specifiers import SpecifierSet

LINES = (ROOT / "Containerfile").read_text(encoding="utf-8").splitlines()
STEPS = [line.split(" ", 1) for line in LINES if line and not line.startswith("#")]
"""Instructions of Containerfile, each with its words."""


def words_of(kind: str) -> list[str]:
    return [words for name, words in STEPS if name == kind]


def test_each_instruction_is_a_line_of_its_own_and_known() -> None:
    assert {name for name, _ in STEPS} == {
        *("FROM", "COPY", "RUN", "LABEL", "WORKDIR", "USER", "ENTRYPOINT"),
    }
    assert not [line for line in LINES if line.endswith("\\")]


def test_what_is_copied_is_there_and_sent_along() -> None:
    sent = {line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    copied = {words.split()[0] for words in words_of("COPY") if not words.startswith("--from")}
    assert copied == sent
    assert all((ROOT / path).exists() for path in copied)


def test_no_wheel_stays_in_the_image() -> None:
    *_, last = (at for at, (name, _) in enumerate(STEPS) if name == "FROM")
    assert not [words for name, words in STEPS[last:] if name == "COPY"]
    [install] = [words for name, words in STEPS[last:] if name == "RUN"]
    assert install.startswith("--mount=type=bind,from=wheels,source=/wheels,target=/wheels python ")


def test_labels_say_what_the_runtime_says_of_itself() -> None:
    settings = tomllib.loads((ROOT / "generator/linkwise_runtime/pyproject.toml").read_text(encoding="utf-8"))
    labels = dict(shlex.split(words)[0].split("=", 1) for words in words_of("LABEL"))
    project = settings["project"]
    assert labels["org.opencontainers.image.title"] == project["name"]
    assert labels["org.opencontainers.image.licenses"] == project["license"]
    assert labels["org.opencontainers.image.source"] == project["urls"]["Source"]


def test_base_images_have_a_python_that_runs_linkwise() -> None:
    asked = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["requires-python"]
    place = json.loads((ROOT / ".devcontainer/devcontainer.json").read_text(encoding="utf-8"))
    images = [*(words.split()[0] for words in words_of("FROM")), place["image"]]
    versions = [re.fullmatch(r"python:(3\.\d+)-\w+", image) for image in images]
    assert all(found and found[1] in SpecifierSet(asked) for found in versions)


def test_the_place_to_work_in_is_made_as_the_makefile_says() -> None:
    place = json.loads((ROOT / ".devcontainer/devcontainer.json").read_text(encoding="utf-8"))
    assert place["postCreateCommand"] == "make .venv/.ready"
    assert "VENV ?= .venv\n" in (ROOT / "Makefile").read_text(encoding="utf-8")
    packages = place["onCreateCommand"].partition("--no-install-recommends ")[2].split()
    ci = (ROOT / ".ci/run").read_text(encoding="utf-8")
    assert packages
    assert not [name for name in packages if not re.search(rf"^need .*\b{name}\b", ci, re.MULTILINE)]


@pytest.mark.ship
def test_its_steps_make_an_environment_in_which_a_package_runs(tmp_path: Path) -> None:
    """Both stages in one environment, with folders of this test for /source, /wheels and /packages."""
    machine = empty_environment(tmp_path / "machine")
    machine.link(["numpy", "setuptools", "pip"])
    here = {f"/{name}": tmp_path / name for name in ("source", "wheels", "packages")}

    def placed(text: str) -> str:
        return re.sub(r"(?<![\w.])(/source|/wheels|/packages)\b", lambda found: str(here[found[1]]), text)

    # What an index would give is linked: NumPy as it is pinned, and setuptools, without isolation.
    alone = {"PIP_NO_INDEX": "1", "PIP_NO_BUILD_ISOLATION": "0"}
    folder = tmp_path
    for name, words in STEPS:
        if name == "COPY" and not words.startswith("--from"):
            source, target = words.split()
            copy = shutil.copytree if (ROOT / source).is_dir() else shutil.copyfile
            copy(ROOT / source, placed(target))
        elif name == "RUN":
            path = f"{machine.programs}{os.pathsep}{os.environ['PATH']}"
            command = re.sub(r"--mount=\S+ ", "", words)  # where the engine shows what is here already
            run("sh", "-e", "-c", placed(command), folder=tmp_path, PATH=path, **alone)
        elif name == "WORKDIR":
            folder = Path(placed(words))
    robot = ROOT / "examples/setuptools/arm.urdf"
    write_package(generate(read_system(robot), ["numpy"], "arm"), folder / "arm")
    program = "import arm; print(*arm.load('numpy').inverse_dynamics([0.3, -0.7], [1.0, 0.5], [2.0, -3.0]))"
    [entry] = json.loads(words_of("ENTRYPOINT")[0])
    printed = machine.run(entry, "-c", program, folder=folder)
    model = pin.buildModelFromUrdf(str(robot))
    motion = map(np.array, ([0.3, -0.7], [1.0, 0.5], [2.0, -3.0]))
    expected = pin.rnea(model, model.createData(), *motion)
    assert np.array(printed.split(), float) == pytest.approx(expected, rel=1e-12)
    assert (machine.packages / "linkwise_runtime").is_dir()
    assert not (machine.packages / "linkwise").exists()
