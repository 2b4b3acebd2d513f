"""Windows and macOS, as far as Linux can be made to lack what they lack; see `other_system`."""

import json
import os
import platform
import re
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path, PureWindowsPath

import pytest
from helpers import urdf_text
from helpers.other_system import PROGRAMS, UNFIT, locks
from helpers.search_path import before
from linkwise import LinkwiseError, generate, read_system
from linkwise.cli import depfile
from linkwise.cli.depfile import depfile_text
from linkwise.emit.assemble import DEVICES, checked_identifier
from linkwise_runtime.native.build import STACK, Sources, library, require_stack
from linkwise_runtime.native.cache import cache_directory, is_whole, locked
from linkwise_runtime.native.compiler import FLAGS, AppleCompiler, find_compiler
from linkwise_runtime.native.process import answer, run_all
from linkwise_runtime.native.system import MacOS, Windows

TESTS = Path(__file__).parents[1]
MINGW = "x86_64-w64-mingw32-gcc"
SESSION = """
import json, os, sys
from pathlib import Path
from helpers.command_line import run_linkwise
from linkwise.package.load import import_package

def said(*words):
    done = run_linkwise(*words, folder=Path.cwd())
    told.append((done.returncode, done.stdout, done.stderr))

def there():
    made = (path for path in Path("out").rglob("*") if path.is_file() and path.suffix != ".pyc")
    return {path.as_posix(): path.read_bytes().hex() for path in sorted(made)}

told = []
arm = ("generate", "arm.urdf", "--name", "arm", "--backend", "numpy", "--backend", "native", "--out")
said(*arm, "out")
said("check", "out/arm", "--samples", "3")
before = there()
with open("out/arm/names.py", "rb"):
    said(*arm, "out", "--kernel", "loops")
told[-1] = (*told[-1], there() == before, os.listdir("out"))
said(*arm, "OUT", "--kernel", "loops", "--verbose")
told[-1] = (*told[-1], there() == before, os.listdir("out"))
said("generate", "arm.urdf", "--out", "out", "--depfile", "ARM.URDF")
said("analyze", "out/log.csv", "--robot", "OUT/arm", "--out", "Out")
said("generate", "planar3", "--out", "out", "--name", "aux")
try:
    import_package(Path("out/arm")).load("native")
except RuntimeError as error:
    told.append((None, "", str(error)))
Path("told.json").write_text(json.dumps(told))
sys.argv = ["linkwise", "--help"]
from linkwise.cli.app import main
main()
"""


@pytest.mark.parametrize("system", ["windows", "macos"])
def test_commands_work_there_and_say_what_stands_in_the_way(system: str, tmp_path: Path) -> None:
    parts = [urdf_text.joint("ab", "a", "b"), urdf_text.joint("bc", "b", "c")]
    (tmp_path / "arm.urdf").write_text(urdf_text.chain(*parts))
    (tmp_path / "session.py").write_text(SESSION)
    few = {"PATH": "/nowhere", "PYTHONPATH": before(TESTS), "PYTHONUTF8": "0", "PYTHONIOENCODING": "cp1252"}
    command = [sys.executable, str(TESTS / "helpers/other_system.py"), system, "--core", "session.py"]
    done = subprocess.run(command, cwd=tmp_path, env=os.environ | few, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b""), done.stderr.decode(errors="replace")
    assert b"generate" in done.stdout
    told = json.loads((tmp_path / "told.json").read_text())
    made, checked, held, again, depfile, analyzed, device, native = told
    assert made == [0, "", ""]
    missing = f"a C compiler and found none: {(Windows if system == 'windows' else MacOS).install}"
    assert checked[0] == 0
    assert re.search(rf"native: not checked +.*{re.escape(missing)}", checked[1])
    if system == "windows":
        error = (
            "linkwise: error: out/arm: nothing was written: Access is denied; close the programs that have "
        )
        assert held == [2, "", f"{error}files there open, or choose another place\n", True, ["arm"]]
    assert again[0] == 0
    assert again[3:] == [False, ["arm"]]
    assert (depfile[0], analyzed[0], device[0]) == (2, 2, 2)
    assert "ARM.URDF cannot be a depfile" in depfile[2]
    assert "--out Out is to be replaced and holds the log" in analyzed[2]
    assert "is what a device of Windows is called" in device[2]
    assert missing in native[2]
    assert "\n" not in native[2]


@pytest.fixture
def on(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Has linkwise take this system for another."""

    def take(name: str) -> None:
        monkeypatch.setattr(sys, "platform", name)
        monkeypatch.setitem(sys.modules, "msvcrt", locks())
        monkeypatch.setenv("PATHEXT", ".exe")
        if name == "win32":
            monkeypatch.setattr(shutil, "_winapi", PROGRAMS, raising=False)

    return take


def test_each_system_has_its_own_place_for_caches(
    on: Callable[[str], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for variable in ("LINKWISE_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    on("darwin")
    assert cache_directory() == tmp_path / "Library/Caches/linkwise"
    on("win32")
    assert cache_directory() == tmp_path / "AppData/Local/linkwise"
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "local"))
    assert cache_directory() == tmp_path / "local/linkwise"
    cache_directory().chmod(0o777)  # as Windows shows every folder
    assert cache_directory().is_dir()


def test_a_lock_of_windows_is_waited_for(on: Callable[[str], None], tmp_path: Path) -> None:
    on("win32")
    waits, order = threading.Event(), []

    def second() -> None:
        with locked(tmp_path / "lock", lambda _: waits.set()):
            order.append("second")

    with locked(tmp_path / "lock", lambda _: None):
        thread = threading.Thread(target=second)
        thread.start()
        assert waits.wait(10)
        order.append("first")
    thread.join(10)
    assert order == ["first", "second"]


TINY = (
    "#include <stddef.h>\nvoid tiny_decomposition(size_t count, double *x) { while (count--) *x++ = 1.0; }\n"
)


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Sources:
    (tmp_path / "c").mkdir()
    guarded = f"#define BLOCKS 3\n#if LINKWISE_PART == BLOCKS\n{TINY}#endif\n"
    (tmp_path / "c/tiny.c").write_text(guarded)
    monkeypatch.setenv("LINKWISE_CACHE", str(tmp_path / "cache"))
    return Sources("tiny", tmp_path / "c")


@pytest.mark.skipif(shutil.which(MINGW) is None, reason="needs gcc of MinGW-w64")
def test_native_is_built_on_windows_by_gcc_there(
    tiny: Sources, on: Callable[[str], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", f'"{shutil.which(MINGW)}"')
    on("win32")
    made = library(tiny, "double")
    assert made.suffix == ".dll"
    assert is_whole(made)
    assert made.read_bytes().startswith(b"MZ")
    tiny.file("double").write_text("an error")
    with pytest.raises(RuntimeError, match=r"mingw32-gcc failed: \S*tiny.c:1:1: error: unknown type"):
        library(tiny, "double")
    assert not list(made.parent.glob("*.build"))


def test_c_that_takes_more_stack_than_a_thread_has_is_left_to_the_other_back_ends(
    directory_of: Callable[[str], Path], on: Callable[[str], None], tmp_path: Path
) -> None:
    header = (directory_of("planar3") / "c/planar3.h").read_text(encoding="utf-8")
    (said,) = STACK.findall(header)
    (tmp_path / "planar3.h").write_text(header.replace(said, "1,500,001"), encoding="utf-8")
    require_stack("planar3", tmp_path)
    on("win32")
    require_stack("planar3", directory_of("planar3") / "c")
    with pytest.raises(RuntimeError, match="takes 1,500,001 bytes of stack, and 1,500,000 are the most"):
        require_stack("planar3", tmp_path)


def test_a_program_of_windows_that_does_not_end_is_ended(on: Callable[[str], None], tmp_path: Path) -> None:
    program = tmp_path / "cc"
    program.write_text("#!/bin/sh\nexec sleep 60\n")
    program.chmod(0o755)
    on("win32")
    with pytest.raises(RuntimeError, match="gives no answer in 0 s"):
        answer([str(program)], 0.2)


CLANG = "clang version 17.0.1\nTarget: {}\n"
UNUSABLE = {
    "nothing": ("win32", {}, "found none: install gcc of MinGW-w64 (winget install BrechtSanders"),
    "MSVC": ("win32", {"cl": ""}, "found cl, whose options are not those of gcc: install gcc of MinGW-w64"),
    "clang-cl": (
        "win32",
        {"clang-cl": ""},
        "found clang-cl, whose options are not those of gcc: install gcc",
    ),
    "clang for MSVC": (
        "win32",
        {"clang": CLANG.format("x86_64-pc-windows-msvc"), "cl": ""},
        "found clang for Microsoft's linker: install gcc of MinGW-w64",
    ),
    "no Xcode": ("darwin", {"cc": "", "clang": ""}, "found none installed: install Apple's (xcode-select"),
    "no macOS": ("darwin", {}, "found none: install Apple's (xcode-select --install) or point CC"),
    "clang-cl on Linux": ("linux", {"clang-cl": ""}, "found none: install the package gcc (Debian"),
}


def programs(said: dict[str, str], folder: Path) -> str:
    """A PATH of programs that say something of themselves, under their names on Windows too."""
    folder.mkdir()
    for name, text in said.items():
        for program in (folder / name, folder / f"{name}.exe"):
            program.write_text(f"#!/bin/sh\n/bin/cat <<'END'\n{text}END\n")
            program.chmod(0o755)
    return str(folder)


@pytest.mark.parametrize("case", UNUSABLE)
def test_native_says_in_one_line_what_to_install(
    case: str, on: Callable[[str], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    system, said, expected = UNUSABLE[case]
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", programs(said, tmp_path / "bin"))
    on(system)
    with pytest.raises(RuntimeError) as error:
        find_compiler()
    assert expected in str(error.value)
    assert str(error.value).endswith("; the other back ends need none")
    assert "\n" not in str(error.value)


def test_clang_cl_is_refused_where_cc_names_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", programs({"clang-cl": ""}, tmp_path / "bin"))
    monkeypatch.setenv("CC", "clang-cl /O2")
    with pytest.raises(RuntimeError, match="found clang-cl, whose options are not those of gcc: install"):
        find_compiler()


USABLE = {
    "gcc before clang": ("win32", {"gcc": "gcc (x86_64-posix-seh)\n", "clang": ""}, "gcc"),
    "clang of MinGW": ("win32", {"clang": CLANG.format("x86_64-w64-windows-gnu"), "cl": ""}, "clang"),
    "clang named gcc": ("darwin", {"gcc": "Apple clang version 15.0.0\n"}, "gcc"),
}


@pytest.mark.parametrize("case", USABLE)
def test_the_first_compiler_that_can_be_is_taken(
    case: str, on: Callable[[str], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    system, said, expected = USABLE[case]
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", programs(said, tmp_path / "bin"))
    on(system)
    assert find_compiler().command == (expected,)


def test_apples_compiler_is_left_its_own_processor(monkeypatch: pytest.MonkeyPatch) -> None:
    compiler = AppleCompiler(("cc",))
    monkeypatch.setattr(platform, "machine", lambda: "arm64")
    assert compiler.flags == (*FLAGS, "-fPIC")
    assert "dynamic_lookup" in compiler.extending(Path("module.c"), [], "module.so")
    monkeypatch.setattr(platform, "machine", lambda: "x86_64")
    assert "-march=native" in compiler.flags


def test_backslashes_and_blanks_of_cc_are_those_of_a_path() -> None:
    assert Windows().words(r'"C:\Program Files\gcc.exe" -m64') == [r"C:\Program Files\gcc.exe", "-m64"]


def test_a_depfile_has_slashes_and_drives(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(depfile, "PurePath", PureWindowsPath)
    robot = PureWindowsPath(r"C:\my robots\arm.urdf").as_posix()
    assert depfile_text(["C:/made/arm.stamp"], [robot]).splitlines()[:2] == [
        "C:/made/arm.stamp: \\",
        r"  C:/my\ robots/arm.urdf",
    ]
    for name in ("C:arm", "C:/arm:b", "arm:b"):
        with pytest.raises(LinkwiseError, match="has ':' in it"):
            depfile_text(["t"], [name])


def test_files_of_packages_can_be_on_every_system() -> None:
    for robot, kernel in (("planar3", "straight"), ("torso", "loops")):
        paths = list(generate(read_system(robot), kernel=kernel))
        assert len({path.lower() for path in paths}) == len(paths)
        assert not [path for path in paths if any(map(UNFIT.search, path.split("/")))]
        assert max(map(len, paths)) <= 60  # of the 260 characters that many programs of Windows take


def test_no_package_is_called_as_a_device_of_windows_is() -> None:
    for name in DEVICES:
        assert UNFIT.search(f"{name}.h")
        assert checked_identifier(None, name.upper()) == f"robot_{name}"
        with pytest.raises(LinkwiseError, match="is what a device of Windows is called"):
            checked_identifier(name, "robot")


@pytest.mark.parametrize("in_memory", [True, False])
def test_what_a_program_writes_to_a_file_is_read_once_and_after_its_end_alone(
    in_memory: bool, on: Callable[[str], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both write and read at one place: whoever read before the end would move where the rest is written."""
    on("win32")
    if not in_memory:
        monkeypatch.delattr(os, "memfd_create", raising=False)
    program = [
        "sh",
        "-c",
        "printf half; printf half >&2; sleep 0.4; printf ' and whole'; echo ' and all' >&2; exit 3",
    ]
    assert answer(program, 10) == b"half and whole"
    with pytest.raises(RuntimeError, match=r"^sh failed: half and all$"):
        run_all([program], lambda _: None)
