"""The cache of compiled libraries: what is wrong with it or the compiler is mended, or named in one line."""

import os
import pty
import pwd
import shutil
import signal
import stat
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from conftest import needs_compiler
from linkwise.package.load import import_package
from linkwise_runtime.native import build, cache, process
from linkwise_runtime.native import compiler as compilers
from linkwise_runtime.native.build import Sources, library
from linkwise_runtime.native.cache import cache_directory, is_whole, locked
from linkwise_runtime.native.library import function

pytestmark = needs_compiler

TINY = """
#include <stddef.h>
#define SINES 1
#define ONE_SAMPLE 2
#define BLOCKS 3
#if LINKWISE_PART == BLOCKS
void tiny_decomposition(size_t count, double *x)
{
    while (count--)
        *x++ = 1.0;
}
#endif
"""


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Sources:
    """C that takes no time to compile, and an empty cache."""
    (tmp_path / "c").mkdir()
    (tmp_path / "c/tiny.c").write_text(TINY)
    (tmp_path / "cache").mkdir(mode=0o700)
    monkeypatch.setenv("LINKWISE_CACHE", str(tmp_path / "cache"))
    return Sources("tiny", tmp_path / "c")


def one_line(error: pytest.ExceptionInfo[RuntimeError]) -> str:
    assert "\n" not in str(error.value)
    return str(error.value)


def load_elsewhere(
    package: ModuleType, before: str = "", **environment: str
) -> subprocess.CompletedProcess[str]:
    """Load the package's native back end in another process."""
    folder = Path(str(package.__file__)).parent
    code = f"import sys; sys.path.insert(0, {str(folder.parent)!r})\nimport {folder.name} as package\n"
    command = [sys.executable, "-c", f"{code}{before}\npackage.load('native').backend"]
    return subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=False)


def cut(path: Path) -> None:
    os.truncate(path, path.stat().st_size // 2)


def change(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    path.write_bytes(content)


def link(path: Path) -> None:
    path.rename(path.with_name("elsewhere"))
    path.symlink_to("elsewhere")


def pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


@pytest.mark.parametrize("file", [".so", ".sha256"])
@pytest.mark.parametrize("harm", [cut, change, link, pipe, Path.unlink])
def test_a_library_that_is_not_what_was_written_is_built_again(
    harm: Callable[[Path], None], file: str, tiny: Sources
) -> None:
    path = library(tiny, "double")
    assert is_whole(path)
    harm(path.with_suffix(file))
    assert not is_whole(path)
    assert library(tiny, "double") == path
    assert is_whole(path)
    assert not path.is_symlink()


def test_a_library_that_others_may_change_is_built_again(tiny: Sources) -> None:
    path = library(tiny, "double")
    path.chmod(0o666)
    assert not is_whole(path)
    assert stat.S_IMODE(library(tiny, "double").stat().st_mode) == 0o644
    if os.geteuid() == 0:
        os.chown(path, 12345, -1)
        assert library(tiny, "double").stat().st_uid == 0


def test_a_library_cut_short_does_not_end_the_interpreter(
    package_of: Callable[[str], ModuleType], tmp_path: Path
) -> None:
    package = package_of("planar3")
    done = load_elsewhere(package, LINKWISE_CACHE=str(tmp_path))
    assert (done.returncode, done.stderr) == (0, "")  # what is no terminal is not told of the build
    (made,) = tmp_path.glob("planar3-*.so")
    os.truncate(made, 4096)
    assert load_elsewhere(package, LINKWISE_CACHE=str(tmp_path)).returncode == 0
    assert made.stat().st_size > 4096


def test_a_whole_library_needs_nothing_written(tiny: Sources) -> None:
    path = library(tiny, "double")
    path.with_suffix(".lock").unlink()
    assert library(tiny, "double") == path
    assert not path.with_suffix(".lock").exists()


def test_c_generated_anew_is_not_mixed_with_the_python_that_was_loaded(
    directory_of: Callable[[str], Path], tmp_path: Path
) -> None:
    directory = tmp_path / "planar3"
    shutil.copytree(directory_of("planar3"), directory)
    package = import_package(directory)
    robot, motion = package.load("native"), np.ones((3, 3))
    before = robot.partial_torque(*motion)
    with (directory / "c/planar3.h").open("a") as header:
        header.write("/* of another text */\n")
    for answer in (
        lambda: robot.position_gradient(*motion),
        lambda: package.load("native").partial_torque(*motion.astype("f4")),
    ):
        with pytest.raises(RuntimeError) as error:
            answer()
        assert (
            one_line(error) == "planar3 was generated anew after it was loaded; start Python again to use it"
        )
    np.testing.assert_array_equal(robot.partial_torque(*motion), before)


def test_what_changes_while_it_is_compiled_is_not_kept(
    tiny: Sources, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_all = build.run_all

    def slowly(commands: Sequence[Sequence[str]], tell: process.Tell) -> None:
        run_all(commands, tell)
        tiny.file("double").write_text(TINY.replace("1.0", "2.0"))

    monkeypatch.setattr(build, "run_all", slowly)
    with pytest.raises(RuntimeError, match="tiny was generated anew after it was loaded"):
        library(tiny, "double")
    assert not list(cache_directory().glob("*.so"))


def test_another_source_compiler_or_processor_has_a_library_of_its_own(
    tiny: Sources, monkeypatch: pytest.MonkeyPatch
) -> None:
    """-march=native must not meet another machine where homes are shared."""
    made = [library(tiny, "double")]
    tiny.file("double").write_text(TINY.replace("1.0", "2.0"))
    made.append(library(tiny, "double"))
    monkeypatch.setenv("CC", "cc -O1")
    made.append(library(tiny, "double"))
    with monkeypatch.context() as newer:
        newer.setattr(compilers.Compiler, "version", lambda _: "cc 99")
        made.append(library(tiny, "double"))
    monkeypatch.setattr(build, "processor", lambda: "of another machine")
    made.append(library(tiny, "double"))
    assert len(set(made)) == 5


@pytest.mark.parametrize("plant", [Path.symlink_to, lambda lock, _: os.mkfifo(lock)], ids=["link", "pipe"])
def test_a_lock_that_somebody_planted_is_refused(
    plant: Callable[[Path, Path], None], tiny: Sources, tmp_path: Path
) -> None:
    path = library(tiny, "double")
    path.unlink()
    victim = tmp_path / "victim"
    victim.write_text("precious")
    lock = path.with_suffix(".lock")
    lock.unlink()
    plant(lock, victim)
    with pytest.raises(RuntimeError, match=r"\.lock: it is not a plain file of your own; remove it") as error:
        library(tiny, "double")
    assert str(lock) in one_line(error)
    assert victim.read_text() == "precious"
    assert not path.exists()


def test_a_new_cache_is_private(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LINKWISE_CACHE", str(tmp_path / "new"))
    assert stat.S_IMODE(cache_directory().stat().st_mode) == 0o700


def test_a_link_to_the_cache_is_followed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "there").mkdir(mode=0o700)
    (tmp_path / "link").symlink_to("there")
    monkeypatch.setenv("LINKWISE_CACHE", str(tmp_path / "link"))
    assert cache_directory() == (tmp_path / "there").resolve()


def test_what_stands_in_the_way_of_a_build_is_named(tiny: Sources) -> None:
    path = library(tiny, "double")
    path.unlink()
    path.mkdir()
    with pytest.raises(
        RuntimeError, match=r"^cannot write \S*\.so: Is a directory; set LINKWISE_CACHE"
    ) as error:
        library(tiny, "double")
    one_line(error)
    path.rmdir()
    path.with_suffix(".build").symlink_to(path.parent)
    with pytest.raises(RuntimeError, match=r"^cannot write \S*\.build: File exists; set LINKWISE_CACHE"):
        library(tiny, "double")


@pytest.mark.parametrize("mode", [0o777, 0o720])
def test_a_cache_that_others_may_write_to_is_refused(mode: int, tiny: Sources, tmp_path: Path) -> None:
    (tmp_path / "cache").chmod(mode)
    with pytest.raises(RuntimeError, match=r"other users may write to the cache .*chmod go-w it") as error:
        library(tiny, "double")
    assert str(tmp_path / "cache") in one_line(error)


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root, who alone can give a directory away")
def test_another_users_cache_is_refused(tiny: Sources, tmp_path: Path) -> None:
    os.chown(tmp_path / "cache", 12345, -1)
    with pytest.raises(RuntimeError, match="belongs to another user; set LINKWISE_CACHE") as error:
        library(tiny, "double")
    assert str(tmp_path / "cache") in one_line(error)


def test_without_a_home_directory_the_cache_must_be_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def nobody(_: int) -> None:
        raise KeyError

    for variable in ("LINKWISE_CACHE", "XDG_CACHE_HOME", "HOME"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setattr(pwd, "getpwuid", nobody)
    with pytest.raises(RuntimeError, match="no home directory to keep compiled code in; set LINKWISE_CACHE"):
        cache_directory()


def test_a_relative_xdg_directory_is_void(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("LINKWISE_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache_directory() == tmp_path / ".cache/linkwise"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "shared"))
    assert cache_directory() == tmp_path / "shared/linkwise"


@pytest.mark.parametrize(
    ("variable", "value", "message"),
    [
        ("CC", "no-such-compiler", "apt install gcc"),
        ("CC", '"gcc', "is not a command"),
        ("CC", "true", "true made no library; point CC to a C compiler"),
        ("LINKWISE_CACHE", "/proc", "set LINKWISE_CACHE"),
        ("LINKWISE_CACHE", "/dev/null", "cannot make the cache /dev/null: File exists; set LINKWISE_CACHE"),
    ],
)
def test_a_compiler_or_cache_that_cannot_be_is_named(
    variable: str, value: str, message: str, tiny: Sources, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(variable, value)
    with pytest.raises(RuntimeError) as error:
        library(tiny, "double")
    assert message in one_line(error)


ANSWER = '#!/bin/sh\nif [ "$1" = --version ]; then echo odd; exit 0; fi\n'
COMPILERS = {
    "no shebang": ("no shebang", 0o755, r"cc cannot be run: Exec format error; point CC to a C compiler"),
    "not executable": ("#!/bin/sh\n", 0o644, r"no program .*cc"),
    "an interpreter that is not there": ("#!/no/such/sh\n", 0o755, "cc cannot be run: No such file"),
    "no answer": ("#!/bin/sh\nsleep 60", 0o755, r"cc --version gives no answer in \S+ s; point CC"),
    "no end": (f"{ANSWER}sleep 60", 0o755, r"cc is not done after \S+ s; point CC to another C compiler"),
    "an error": (
        f"{ANSWER}echo 'x.c:1: error: no room' >&2\nexit 3",
        0o755,
        "cc failed: x.c:1: error: no room",
    ),
    "many lines": (f"{ANSWER}printf 'a\\nb\\n' >&2\nexit 3", 0o755, "cc failed: a b; the other back ends"),
    "no room": (
        f"{ANSWER}echo 'in f:\nld: final link failed: No space left on device\nld: error' >&2\nexit 1",
        0o755,
        "cc failed: ld: final link failed: No space left on device; the other back ends",
    ),
    "not text": (f"{ANSWER}printf 'error \\377' >&2\nexit 3", 0o755, "cc failed: error"),
    "no word": (f"{ANSWER}exit 3", 0o755, "cc failed: exit status 3; the other back ends need no compiler"),
    "killed": (f"{ANSWER}kill -9 $$", 0o755, "cc failed: it was ended by SIGKILL"),
    "nothing": (f"{ANSWER}exit 0", 0o755, "cc made no library; point CC to a C compiler"),
}


@pytest.mark.parametrize("kind", COMPILERS)
def test_a_compiler_that_does_not_compile_is_named(
    kind: str, tiny: Sources, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script, mode, message = COMPILERS[kind]
    compiler = tmp_path / "cc"
    compiler.write_text(script)
    compiler.chmod(mode)
    monkeypatch.setenv("CC", str(compiler))
    monkeypatch.setattr(compilers, "ANSWERS", 0.5)
    monkeypatch.setattr(process, "PATIENCE", 0.5)
    with pytest.raises(RuntimeError, match=message) as error:
        library(tiny, "double")
    assert str(compiler) in one_line(error)
    assert [path.suffix for path in (tmp_path / "cache").iterdir()] in ([], [".lock"])


def test_files_of_ones_own_and_of_root_are_taken() -> None:
    assert set(cache._trusted()) == {os.getuid(), 0}


def test_sources_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match=f"^cannot read {tmp_path / 'gone'}: .*; generate it again$"):
        build.digest_of(tmp_path / "gone")


def test_a_pipe_among_the_sources_is_not_waited_for(tiny: Sources) -> None:
    os.mkfifo(tiny.directory / "extra.h")
    with pytest.raises(RuntimeError, match=r"extra\.h is no file; generate it again"):
        library(tiny, "double")


def test_a_library_that_cannot_be_loaded_is_named_and_not_kept(
    tiny: Sources, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiler = tmp_path / "cc"
    compiler.write_text(f'{ANSWER}for last; do :; done; echo rubbish > "$last"')
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    with pytest.raises(
        RuntimeError, match=r"cannot load what was compiled: .*; point CC to another"
    ) as error:
        function(tiny, "decomposition", "f8", 1)
    one_line(error)
    assert not list((tmp_path / "cache").glob("*.so"))


def test_a_full_disk_is_named_and_leaves_nothing(
    package_of: Callable[[str], ModuleType], tmp_path: Path
) -> None:
    package = package_of("planar3")
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))"
    place = {"LINKWISE_CACHE": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
    done = load_elsewhere(package, limit, **place)
    assert done.returncode == 1
    assert "gcc failed" in done.stderr.splitlines()[-1] or "cc failed" in done.stderr.splitlines()[-1]
    assert {path.suffix for path in tmp_path.iterdir()} <= {".lock"}
    assert load_elsewhere(package, **place).returncode == 0


def test_what_a_killed_build_left_is_swept(tiny: Sources) -> None:
    path = library(tiny, "double")
    path.unlink()
    left = path.with_suffix(".build")
    left.mkdir()
    (left / "BLOCKS.o").write_text("half of it")
    library(tiny, "double")
    assert is_whole(path)
    assert not left.exists()


def test_one_builds_while_the_others_wait(tiny: Sources) -> None:
    path = library(tiny, "double")
    path.unlink()
    done = threading.Thread(target=library, args=(tiny, "double"))
    with locked(path.with_suffix(".lock"), lambda _: None):
        done.start()
        done.join(0.3)
        assert done.is_alive()
        assert not path.exists()
    done.join(30)
    assert is_whole(path)


def test_a_server_that_a_compiler_leaves_behind_is_not_waited_for(
    tiny: Sources, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiler = tmp_path / "cc"
    compiler.write_text(f'#!/bin/sh\nsleep 60 & echo $! >> {tmp_path}/started\nexec gcc "$@"')
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    start = time.monotonic()
    assert is_whole(library(tiny, "double"))
    assert time.monotonic() - start < 20.0
    for number in (tmp_path / "started").read_text().split():
        os.kill(int(number), signal.SIGKILL)


def test_parts_count_as_they_are_done(tmp_path: Path) -> None:
    heard = []

    def tell(note: str) -> None:
        heard.append(int(note.split(" of 3 parts, ")[0]))
        (tmp_path / str(heard[-1])).touch()

    waiting = "until [ -e {}/{} ]; do sleep 0.02; done"
    process.run_all([["sh", "-c", waiting.format(tmp_path, count)] for count in (2, 0, 1)], tell)
    assert list(dict.fromkeys(heard)) == [0, 1, 2]


def test_a_compiler_that_is_given_up_is_ended(
    tiny: Sources, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiler = tmp_path / "cc"
    compiler.write_text(f"{ANSWER}sleep 60 &\necho $! >> {tmp_path}/started\nwait")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    monkeypatch.setattr(process, "PATIENCE", 0.5)
    with pytest.raises(RuntimeError, match="not done"):
        library(tiny, "double")
    started = (tmp_path / "started").read_text().split()
    patience = time.monotonic() + 10  # a killed process may take its turn to end; the child would take 60 s
    while not all(map(_ended, started)) and time.monotonic() < patience:
        time.sleep(0.02)
    assert all(map(_ended, started))


def _ended(number: str) -> bool:
    try:
        return Path(f"/proc/{number}/stat").read_text().split()[2] == "Z"
    except OSError:
        return True


def test_a_terminal_is_told_of_the_build(package_of: Callable[[str], ModuleType], tmp_path: Path) -> None:
    package = package_of("planar3")
    folder = Path(str(package.__file__)).parent
    code = f"import sys; sys.path.insert(0, {str(folder.parent)!r}); import planar3; planar3.load('native')"
    reader, writer = pty.openpty()
    environment = os.environ | {"LINKWISE_CACHE": str(tmp_path)}
    subprocess.run([sys.executable, "-c", code], env=environment, stderr=writer, check=True)
    os.write(writer, b"end")  # so that there is something to read, whatever was said
    said = ""
    while not said.endswith("end"):
        said += os.read(reader, 1 << 16).decode()
    assert "\rcompiling planar3 (decomposition, double), once: 0 of 3 parts, 0 s" in said
    assert "\rcompiling planar3 (decomposition, double), once: linking  " in said
    assert said.endswith(f"\r{'':79}\rend")
    subprocess.run([sys.executable, "-c", code], env=environment, stderr=writer, check=True)
    os.write(writer, b"nothing more")
    assert os.read(reader, 1 << 16) == b"nothing more"
