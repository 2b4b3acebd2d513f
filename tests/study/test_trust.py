"""A study's file may have little done: it names files to read, and runs no code by itself."""

import hashlib
import json
import socket
import zipfile
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest
from conftest import DATA
from helpers import urdf_text
from helpers.command_line import run_linkwise
from helpers.studies import CHOICES, HEAD, QUICK, TRIALS, Here, write_study
from linkwise import LinkwiseError, generate, kept_package, read_system, write_package
from linkwise.errors import LinkwiseWarning
from linkwise.progress import silent
from linkwise.study import run_study
from linkwise.study.file import read_study
from linkwise.study.robots import check_robots

ENERGIES = (DATA / "cart_pendulum.py").read_text()


def of_one_trial(folder: Path, log: str, robot: str) -> Path:
    """A study of one trial, whose table of motion lies beside it as log.csv."""
    rows = "\n".join(f"{k / 100},{k % 5},{k % 7}" for k in range(50))
    (folder / "log.csv").write_text(f"time,x,theta\n{rows}\n")
    trial = f'[[trial]]\nname = "a"\nlog = "{log}"\nrobot = "{robot}"\ncondition = "x"\n'
    return write_study(folder, HEAD, "pages = false\n", trial, subjects=0)


def with_program(folder: Path, robot: str) -> Path:
    """A study of a robot of energies that leaves a file when it is run."""
    (folder / "cart.py").write_text(f"{ENERGIES}\nopen({str(folder / 'ran')!r}, 'w').close()\n")
    return of_one_trial(folder, "log.csv", robot)


@pytest.fixture
def web(tmp_path: Path) -> Iterator[str]:
    """The address of a server of the test's folder."""
    pytest.importorskip("aiohttp")

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(tmp_path))) as server:
        Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@pytest.mark.parametrize("name", ["cart.py", "arm.urdf?/cart.py"])
def test_python_at_an_address_is_never_run(name: str, web: str, tmp_path: Path) -> None:
    file = with_program(tmp_path, f"{web}/{name}")
    with pytest.raises(LinkwiseError, match=r"trial 'a': robot http.* from elsewhere, which is never run"):
        run_study(file, tmp_path / "out", Here(), trust_python=True)
    assert not (tmp_path / "ran").exists()


def test_python_beside_a_study_is_run_only_where_that_is_asked_for_and_then_told(tmp_path: Path) -> None:
    file, ran = with_program(tmp_path, "file://cart.py"), tmp_path / "ran"
    done = run_linkwise("study", file, "--out", "out", "--workers", 1, folder=tmp_path)
    assert (done.returncode, done.stdout, ran.exists()) == (2, "", False)
    (said,) = done.stderr.splitlines()
    assert said.startswith(
        f"linkwise: error: {file}: trial 'a': robot {tmp_path}/cart.py is a Python program"
    )
    assert "--trust-python" in said
    done = run_linkwise("study", file, "--out", "out", "--workers", 1, "--trust-python", folder=tmp_path)
    assert (done.returncode, ran.exists()) == (0, True)
    assert f"note: {tmp_path}/cart.py is a Python program, which was run" in done.stderr.splitlines()


def test_a_package_of_another_version_is_not_run_by_a_study(tmp_path: Path) -> None:
    """The runtime that it carries is not at hand to compare with, and may do anything."""
    file, mark = with_program(tmp_path, "cart"), tmp_path / "was run"
    made = generate(read_system(DATA / "cart_pendulum.py"), ["numpy"], vendor_runtime=True)
    write_package(made, tmp_path / "cart")
    runtime, manifest = tmp_path / "cart/linkwise_runtime/structure.py", tmp_path / "cart/manifest.json"
    runtime.write_text(f"{runtime.read_text()}\nopen({str(mark)!r}, 'w').close()\n")
    data = json.loads(manifest.read_text())
    data["generator"]["linkwise"] = data["runtime"]["version"] = "0.0.9"
    data["files"]["linkwise_runtime/structure.py"] = hashlib.sha256(runtime.read_bytes()).hexdigest()
    data["checksums"] = {
        key: hashlib.sha256(json.dumps(data[key], sort_keys=True).encode()).hexdigest()
        for key in data["checksums"]
    }
    manifest.write_text(json.dumps(data))
    with pytest.raises(LinkwiseError, match=r"package of linkwise 0\.0\.9, .* give --trust-python"):
        run_study(file, tmp_path / "out", Here())
    assert not mark.exists()
    with pytest.warns(LinkwiseWarning, match="its code runs"), pytest.raises(LinkwiseError, match=r"0\.0\.9"):
        run_study(file, tmp_path / "out", Here(), trust_python=True)
    assert mark.exists()


def test_a_trial_of_a_changed_program_is_done_again(tmp_path: Path) -> None:
    file, out = with_program(tmp_path, "cart.py"), tmp_path / "out"
    fresh = []
    for _ in range(2):
        fresh += [run_study(file, out, Here(), trust_python=True).fresh for _ in range(2)]
        (tmp_path / "cart.py").write_text(ENERGIES.replace("M: 2.0", "M: 3.0"))
    assert fresh == [1, 0, 1, 0]


@pytest.mark.parametrize(
    "command",
    [
        ("generate", "cart.py", "--out", "out"),
        ("inspect", "cart.py", "--json"),
        ("report", "terms", "cart.py"),
        ("report", "reduction", "--robot", "cart.py"),
        ("analyze", "log.csv", "--robot", "cart.py", "--out", "out", "--no-page"),
    ],
    ids=" ".join,
)
def test_a_program_named_on_the_command_line_is_told_to_have_been_run(
    command: tuple[str, ...], tmp_path: Path
) -> None:
    with_program(tmp_path, "cart.py")
    done = run_linkwise(*command, folder=tmp_path)
    assert done.returncode == 0
    assert "note: cart.py is a Python program, which was run" in done.stderr.splitlines()


@pytest.mark.parametrize(
    "address",
    [
        "zip://data/S1/slow_1.csv::file://{here}/logs.zip",
        "simplecache::file://{here}/data/S1/slow_1.csv",
        "s3://lab/log.csv::file://{here}/data/S1/slow_1.csv",
        "reference://log.csv",
        "local://{here}/data/S1/slow_1.csv",
        "dir://{here}/data/S1/slow_1.csv",
        "nowhere://log.csv",
        "reference::log.csv",
    ],
)
def test_only_addresses_of_stores_are_read(address: str, tmp_path: Path) -> None:
    file = write_study(tmp_path, subjects=1, trials=1)
    with zipfile.ZipFile(tmp_path / "logs.zip", "w") as packed:
        packed.write(tmp_path / "data/S1/slow_1.csv", "data/S1/slow_1.csv")
    log = address.format(here=tmp_path)
    trial = f'[[trial]]\nname = "a"\nlog = "{log}"\nrobot = "planar3"\ncondition = "x"\n'
    file.write_text("".join((HEAD, QUICK, CHOICES, trial)))
    with pytest.raises(LinkwiseError) as caught:
        run_study(file, tmp_path / "out", Here())
    assert str(caught.value).startswith(f"{file}: trial 'a': {log}: give a file, or an address of s3, ")


@pytest.mark.parametrize("trust", [False, True])
def test_a_program_inside_an_address_is_refused_as_such_and_not_to_be_trusted(
    trust: bool, tmp_path: Path
) -> None:
    file = of_one_trial(tmp_path, "log.csv", "reference::evil.py")
    with pytest.raises(LinkwiseError, match=r"trial 'a': reference::evil\.py: give a file, .* without '::'"):
        run_study(file, tmp_path / "out", Here(), trust_python=trust)


@pytest.mark.parametrize("trust", [False, True])
def test_a_program_that_is_not_there_is_not_to_be_trusted(trust: bool, tmp_path: Path) -> None:
    file = of_one_trial(tmp_path, "log.csv", "./gone.py")
    with pytest.raises(LinkwiseError, match=r"trial 'a': .*/gone\.py: no such file"):
        run_study(file, tmp_path / "out", Here(), trust_python=trust)


def test_a_file_with_the_sign_of_chains_in_its_name_is_read(tmp_path: Path) -> None:
    (tmp_path / "a::b").mkdir()
    file = write_study(tmp_path / "a::b", subjects=1, trials=1)
    (tmp_path / "a::b/data/S1/slow_1.csv").rename(tmp_path / "a::b/x::y.csv")
    for log in ("x::y.csv", "x::{name}.csv"):
        trial = f'[[trial]]\nlog = "{log}"\nrobot = "planar3"\ncondition = "x"\n'
        file.write_text("".join((HEAD, QUICK, CHOICES, trial)))
        assert len(run_study(file, tmp_path / "out", Here()).done) == 1


def test_a_file_called_by_its_scheme_lies_where_paths_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Paths start from the study's file, and not from wherever the command was given."""
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS.replace('"data', '"file://data'), subjects=1)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert len(run_study(file, tmp_path / "out", Here()).done) == 4


@pytest.mark.parametrize(
    "files", [("{}/log.csv", "planar3"), ("log.csv", "{}/arm.urdf")], ids=["log", "robot"]
)
def test_a_server_that_refuses_the_connection_is_told_apart_from_one_without_the_file(
    files: tuple[str, str], web: str, tmp_path: Path
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as nobody:
        refusing = f"http://127.0.0.1:{nobody.getsockname()[1]}"
    for server, said in ((refusing, "Connection refused: "), (f"{web}/gone", "no such file")):
        file = of_one_trial(tmp_path, *(path.format(server) for path in files))
        with pytest.raises(LinkwiseError) as caught:
            run_study(file, tmp_path / "out", Here())
        address = next(path for path in files if "{" in path).format(server)
        assert str(caught.value).startswith(f"{file}: trial 'a': {address}: {said}")


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("bad.csv", "time,joint1,joint2,joint3\n0,x,0,0\n", "row 2, column 'joint1': 'x' is not a number"),
        ("bad.urdf", '<robot name="a"><link name="a"/></robot>', "no joint moves"),
        ("bad.xml", "<mujoco><worldbody>", "malformed XML: no element found"),
        ("bad.toml", "schema = 1\n[[link]]\n", "link None needs 'name'"),
    ],
    ids=["log", "urdf", "mjcf", "toml"],
)
def test_a_mistake_in_a_file_that_was_fetched_is_told_of_its_address(
    name: str, text: str, said: str, web: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_text(text)
    address = f"{web}/{name}"
    is_log = name.endswith(".csv")
    file = of_one_trial(tmp_path, address if is_log else "log.csv", "planar3" if is_log else address)
    with pytest.raises(LinkwiseError) as caught:
        run_study(file, tmp_path / "out", Here())
    assert str(caught.value).startswith(f"{file}: trial 'a': {address}: {said}")


def test_what_touches_the_torques_of_a_robot_that_was_fetched_is_told_of_its_address(
    web: str, tmp_path: Path
) -> None:
    chain = urdf_text.chain(urdf_text.joint("ab", "a", "b"), urdf_text.joint("bc", "b", "c", type="floating"))
    (tmp_path / "arm.urdf").write_text(chain)
    plan = read_study(of_one_trial(tmp_path, "log.csv", f"{web}/arm.urdf"))
    (told,) = check_robots(plan, silent)
    assert told.startswith(f"{web}/arm.urdf: ")


def test_an_error_of_a_robots_file_names_it_where_a_log_is_read_too(tmp_path: Path) -> None:
    robot = tmp_path / "bad.xml"
    robot.write_text("<mujoco><worldbody>")
    with pytest.raises(LinkwiseError) as caught:
        kept_package(robot)
    assert str(caught.value).startswith(f"{robot}: malformed XML: no element found")
