"""Endings of commands: one printable line on stderr whatever was wrong, and a telling exit status."""

import errno
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from helpers.motion_logs import PLANAR3, smooth, write_csv
from house.test_names import chain
from linkwise import progress
from linkwise.cli import app
from linkwise.errors import LinkwiseError
from linkwise.extras import LEAST_ADDRESSES
from linkwise_runtime.version import VERSION

Ending = Callable[..., tuple[int, str]]
COMMAND = (sys.executable, "-m", "linkwise")


@pytest.fixture
def ending(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Ending:
    """Run the command line here; returns its exit status, and the one line that stderr must hold."""

    def run(*arguments: object) -> tuple[int, str]:
        monkeypatch.setattr(sys, "argv", ["linkwise", *map(str, arguments)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            app.main()
        said = capsys.readouterr().err
        assert said.count("\n") <= 1
        assert said.removesuffix("\n").isprintable()
        return int(ended.value.code or 0), said.removesuffix("\n")

    return run


@pytest.fixture
def raising(monkeypatch: pytest.MonkeyPatch) -> Callable[[BaseException], None]:
    """Make the reading of every robot raise an error."""

    def patch(error: BaseException) -> None:
        def read(*_: object) -> None:
            raise error

        monkeypatch.setattr("linkwise.pipeline.read_system", read)

    return patch


def test_version_is_printed_and_needs_no_library(ending: Ending, capsys: pytest.CaptureFixture[str]) -> None:
    done = subprocess.run([*COMMAND, "--version"], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == (f"linkwise {VERSION}\n", "")
    assert ending("--version") == (0, "")


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (LinkwiseError("a\x1b[31m\n\u202eb"), r"error: a\x1b[31m \u202eb"),
        (KeyboardInterrupt(), "interrupted"),
        (MemoryError(), "error: there is not enough memory for this; give a smaller input"),
        (PermissionError(errno.EACCES, "Permission denied", "a\nb"), r"error: a b: Permission denied"),
        (OSError(errno.ENOSPC, "No space left on device"), "error: standard output: No space left"),
        (OSError(errno.ELOOP, "Too many levels", "x"), "error: x: Too many levels"),
    ],
)
def test_what_stands_in_the_way_is_one_line(
    error: BaseException, line: str, ending: Ending, raising: Callable[[BaseException], None]
) -> None:
    raising(error)
    status, said = ending("inspect", "planar3")
    assert said.startswith(f"linkwise: {line}")
    assert status == (130 if isinstance(error, KeyboardInterrupt) else 2)


@pytest.mark.parametrize(
    "error", [ValueError("a\nb" * 9999), RecursionError(), OverflowError("no"), UnicodeError("\udcff")]
)
def test_a_fault_of_linkwise_says_so_and_has_a_status_of_its_own(
    error: Exception,
    ending: Ending,
    raising: Callable[[BaseException], None],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    raising(error)
    status, said = ending("inspect", "planar3")
    assert status == 70
    assert said.startswith(f"linkwise: fault: {type(error).__name__} (cli/inspect.py, line ")
    assert "this is a fault of linkwise, not of your input" in said
    assert "LINKWISE_TRACEBACK=1" in said
    assert len(said) < 1000
    monkeypatch.setenv("LINKWISE_TRACEBACK", "1")
    with pytest.raises(SystemExit):
        app.main()
    assert "Traceback (most recent call last)" in capsys.readouterr().err


def test_a_long_message_keeps_its_start_and_its_end(
    ending: Ending, raising: Callable[[BaseException], None]
) -> None:
    raising(LinkwiseError(f"place: {'x' * 9999}; mend it"))
    said = ending("inspect", "planar3")[1]
    assert len(said) < 1100
    assert said.startswith("linkwise: error: place: xxx")
    assert said.endswith("xxx; mend it")


@pytest.fixture
def unusual(tmp_path: Path) -> dict[str, Path]:
    """Paths that are no files to be read."""
    os.mkfifo(tmp_path / "pipe")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / "socket"))
    (tmp_path / "endless").symlink_to("/dev/zero")
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "gone").symlink_to("nowhere")
    (tmp_path / "folder").mkdir()
    return {
        "pipe": tmp_path / "pipe",
        "socket": tmp_path / "socket",
        "device": tmp_path / "endless",
        "symbolic links": tmp_path / "loop",
        "no such file": tmp_path / "gone",
        "directory": tmp_path / "folder",
        "too long": tmp_path / ("x" * 5000),
        "null byte": tmp_path / "a\0b",
    }


KINDS = ("pipe", "socket", "device", "symbolic links", "no such file", "directory", "too long", "null byte")
SAID = {"no such file": ("no such file", "No such file"), "null byte": ("null byte", "null character")}
"""Words of which one is in the message, where it is not the kind itself: Python's own differ from 3.14 on."""


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_no_file_is_not_opened(kind: str, unusual: dict[str, Path], ending: Ending) -> None:
    path = unusual[kind]
    out = path.parent / "out"
    commands = [
        ("inspect", "{}.toml"),
        ("inspect", "{}.py"),
        ("generate", "{}.urdf", "--out", out),
        ("analyze", "{}.csv", "--robot", PLANAR3, "--out", out),
        ("analyze", "{}.parquet", "--robot", PLANAR3, "--out", out),
        ("report", "reduction", "--dof", "1", "--seconds", "{}.json"),
    ]
    for command in commands:
        name = next(str(word) for word in command if "{}" in str(word)).format(path)
        if kind not in ("too long", "null byte"):
            Path(name).symlink_to(path)
        status, said = ending(*(str(word).format(path) for word in command))
        assert status == 2, said
        assert any(words in said for words in SAID.get(kind, (kind,))), said
    assert not out.exists()


def test_a_reader_that_has_enough_is_no_error() -> None:
    with subprocess.Popen(
        [*COMMAND, "inspect", "--details", "planar300"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as done:
        assert done.stdout.read(1) == b"p"
        done.stdout.close()
        assert (done.wait(), done.stderr.read()) == (141, b"")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_behind_stdout_is_one_line() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [*COMMAND, "--version"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert (done.returncode, done.stderr) == (
        2,
        "linkwise: error: standard output: No space left on device\n",
    )


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_mistake_that_a_full_disk_leaves_no_place_to_tell_has_its_status() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run([*COMMAND, "check", "nowhere"], stderr=full, check=False)
    assert done.returncode == 2


@pytest.mark.skipif(sys.platform != "linux", reason="needs ulimit -v")
def test_bounded_addresses_are_enough_or_told(tmp_path: Path) -> None:
    """Arrow reserves a gigabyte otherwise, and ends the process where what is left does not suffice.

    So does OpenBLAS for each of many threads, which it begins when it is loaded.
    """
    pytest.importorskip("pyarrow")
    shown = (
        "import os; from linkwise.extras import extra;"
        " print(extra('pyarrow').default_memory_pool().backend_name, os.environ['OPENBLAS_NUM_THREADS'])"
    )

    def run(bound: int) -> subprocess.CompletedProcess[str]:
        words = ["sh", "-c", f'ulimit -v {bound}; exec "$@"', "sh", sys.executable, "-c", shown]
        return subprocess.run(words, capture_output=True, text=True, check=False)

    assert run(1_500_000).stdout == "system 1\n"
    assert (
        "LinkwiseError: ulimit -v leaves 0.92 GB of addresses, too few for pyarrow; allow 1 GB"
        in run(900_000).stderr
    )


@pytest.mark.skipif(sys.platform != "linux", reason="needs ulimit -v")
@pytest.mark.parametrize("bound", [150_000, 300_000, 390_000])
@pytest.mark.parametrize("command", ["inspect", "check", "analyze", "study", "identify"])
def test_too_few_addresses_for_a_command_are_told_before_its_libraries_are_loaded(
    command: str, bound: int
) -> None:
    words = ["sh", "-c", f'ulimit -v {bound}; exec "$@"', "sh", *COMMAND, command, "nowhere"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    said = f"linkwise: error: ulimit -v leaves {bound * 1024 / 1e9:.2g} GB of addresses, too few for "
    assert (done.returncode, done.stderr[: len(said)], done.stderr.count("\n")) == (2, said, 1)


@pytest.mark.skipif(sys.platform != "linux", reason="needs ulimit -v")
def test_the_addresses_that_are_asked_for_are_enough() -> None:
    bound = LEAST_ADDRESSES["numpy"] // 1000
    words = ["sh", "-c", f'ulimit -v {bound}; exec "$@"', "sh", *COMMAND, "inspect", "planar3"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("closed", ["2>&-", ">&-", "<&- >&- 2>&-"])
def test_streams_that_the_caller_closed_change_nothing_else(closed: str, tmp_path: Path) -> None:
    def run(*words: str) -> tuple[int, str]:
        command = ["sh", "-c", f'exec "$@" {closed}', "sh", *COMMAND, *words]
        done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
        return done.returncode, done.stdout

    assert run("inspect", "gone.toml") == (2, "")
    status, printed = run("generate", "planar1", "--out", "out", "--backend", "numpy")
    assert (status, printed) == (0, "")
    assert (tmp_path / "out/planar1/manifest.json").is_file()


@pytest.mark.parametrize("numbers", [(2,), (1, 2), (0, 1, 2)])
def test_programs_that_linkwise_starts_may_write_to_streams_that_the_caller_closed(
    numbers: Sequence[int],
) -> None:
    code = (
        "from linkwise.__main__ import _open_closed; import os, subprocess, sys; _open_closed(); "
        "sys.exit(subprocess.run(['sh', '-c', 'echo 1 && echo 2 >&2 && cat'], close_fds=False).returncode)"
    )
    closed = " ".join(f"{number}{'<' if number == 0 else '>'}&-" for number in numbers)
    command = ["sh", "-c", f'exec "$@" {closed}', "sh", sys.executable, "-c", code]
    assert subprocess.run(command, stdin=subprocess.DEVNULL, check=False).returncode == 0


def test_a_file_that_took_the_number_of_a_closed_stream_stays_open(tmp_path: Path) -> None:
    code = (
        "from linkwise.__main__ import _open_closed; import os, sys; "
        f"there = os.open({str(tmp_path / 'there')!r}, os.O_WRONLY | os.O_CREAT); assert there == 2; "
        "_open_closed(); os.write(there, b'kept'); print('lost', file=sys.stderr)"
    )
    command = ["sh", "-c", 'exec "$@" 2>&-', "sh", sys.executable, "-c", code]
    assert subprocess.run(command, check=False).returncode == 0
    assert (tmp_path / "there").read_bytes() == b"kept"


def test_letters_that_the_terminal_lacks_are_written_as_escapes() -> None:
    done = subprocess.run(
        [*COMMAND, "report", "terms", "planar1"],
        env=os.environ | {"PYTHONIOENCODING": "ascii"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert r"| \u03c4_1,1 | link1 |" in done.stdout


WAITING = """
import signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell starts jobs in the background without it
from linkwise import pipeline
from linkwise.cli.app import main
pipeline.read_system = lambda *_: (print("reading", flush=True), time.sleep(60))
sys.argv = ["linkwise", "generate", "planar3", "--out", "out"]
main()
"""


def test_ctrl_c_is_one_line_and_leaves_nothing(tmp_path: Path) -> None:
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", WAITING], cwd=tmp_path, text=True, **pipes) as done:
        assert done.stdout.readline() == "reading\n"
        done.send_signal(signal.SIGINT)
        assert (done.wait(), done.stderr.read()) == (130, "linkwise: interrupted\n")
    assert not list(tmp_path.iterdir())


IMPATIENT = """
import signal
from linkwise import __main__ as start
signal.signal(signal.SIGINT, signal.default_int_handler)
start._heed_one_interrupt()
for now in (10.0, 10.0, 19.9, 20.1, 20.2):
    start.time.monotonic = lambda: now
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt:
        print(now)
signal.signal(signal.SIGINT, signal.SIG_IGN)
start._heed_one_interrupt()
print(signal.getsignal(signal.SIGINT).name)
"""


def test_the_first_ctrl_c_decides_and_another_only_where_the_end_is_overdue() -> None:
    done = subprocess.run([sys.executable, "-c", IMPATIENT], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["10.0", "20.1", "SIG_IGN"]


DELETED = """
import signal, time
from linkwise import __main__ as start
signal.signal(signal.SIGINT, signal.default_int_handler)
start._heed_one_interrupt()
class Writer:
    def __del__(self):
        signal.raise_signal(signal.SIGINT)
        print("deleted")
try:
    Writer()
    time.sleep(10)
except KeyboardInterrupt:
    print("interrupted")
"""


def test_ctrl_c_while_an_object_is_deleted_is_not_lost() -> None:
    done = subprocess.run([sys.executable, "-c", DELETED], capture_output=True, text=True, check=True)
    assert (done.stdout.split(), done.stderr) == (["deleted", "interrupted"], "")


def test_quick_work_on_no_terminal_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with progress.progress() as report:
        report("analysing", 1000, 1000)
    assert capsys.readouterr().err == ""


def test_the_bar_is_gone_before_an_error_is_told(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")

    def fail() -> None:
        with progress.progress() as report:
            report("reading", 1, 2)
            raise LinkwiseError("damaged")

    with pytest.raises(LinkwiseError):
        fail()
    said = capsys.readouterr().err
    assert said.endswith("\x1b[1A\x1b[2K")  # one line up, and erased


@pytest.mark.parametrize("command", ["generate", "inspect", "analyze"])
def test_names_in_what_is_said_break_and_colour_nothing(
    command: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    evil = "\x1b[31mred\u202e\n\x9b0m"
    log = write_csv(tmp_path / "log.csv", smooth(30, 4), ("joint1", "joint2", "joint3", "extra\x1b[31m"))
    robot = tmp_path / "robot.toml"
    robot.write_text(chain("r", (evil,)))
    arguments = {
        "generate": ("generate", robot, "--out", tmp_path / evil, "--backend", "c", "--verbose"),
        "inspect": ("inspect", robot),
        "analyze": (
            *("analyze", log, "--robot", PLANAR3, "--out", tmp_path / "out", "--ignore-extra"),
            "--no-page",
        ),
    }
    monkeypatch.setattr(sys, "argv", ["linkwise", *map(str, arguments[command])])
    with pytest.raises(SystemExit) as ended:
        app.main()
    said = capsys.readouterr()
    assert ended.value.code == 0
    assert (said.out + said.err).replace("\n", "").isprintable()
    assert r"\x1b[31m" in said.out + said.err
