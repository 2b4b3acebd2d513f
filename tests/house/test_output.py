"""Folders and files appear whole or not at all, whatever happens to their writer."""

import os
import shutil
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace

import pytest
from helpers.faults import NAMES, NO_EXCHANGE, faults, suffer, untraceable
from linkwise import LinkwiseError
from linkwise.output import exchange, require_writable, sweep, whole_directory, workplace, write_files

WAYS: dict[str, tuple[str, ...]] = {"exchange": (), "renames": (NO_EXCHANGE,)}

injects = pytest.mark.skipif(untraceable() != "", reason=untraceable())
each_way = pytest.mark.parametrize("way", WAYS)


def nothing_refused(_: Path) -> None:
    pass


def write(target: Path, text: str, names: Sequence[str] = NAMES) -> None:
    with whole_directory(target, nothing_refused) as draft:
        for name in names:
            (draft / name).parent.mkdir(exist_ok=True)
            (draft / name).write_text(text)


def content(target: Path) -> str:
    """The one text of all files; fails for a folder that isn't whole."""
    files = {file.relative_to(target).as_posix(): file for file in target.rglob("*") if file.is_file()}
    assert sorted(files) == list(NAMES)
    [text] = {file.read_text() for file in files.values()}
    return text


def prepare(where: Path) -> None:
    shutil.rmtree(where, ignore_errors=True)
    write(where / "target", "old")


def left(where: Path, way: str) -> str:
    """Return what a fault leaves of the target, read as linkwise does."""
    if not (where / "target").exists():
        assert WAYS[way], "the target is gone, between two renames"
        sweep(where)
    return content(where / "target")


def next_writer_tidies(where: Path) -> bool:
    write(where / "target", "next")
    return content(where / "target") == "next" and os.listdir(where) == ["target"]


@injects
@each_way
def test_a_kill_at_any_call_leaves_the_old_or_the_new_and_the_next_writer_tidies_up(
    way: str, tmp_path: Path
) -> None:
    plan = faults("write", tmp_path, prepare, WAYS[way])
    ends = suffer("write", tmp_path, prepare, plan, "signal=SIGKILL", WAYS[way])
    for number, (fault, end) in enumerate(zip(plan, ends, strict=True)):
        where = tmp_path / str(number)
        assert end.status == -9, fault
        assert left(where, way) in ("old", "new"), fault
        assert next_writer_tidies(where), fault
    assert len(plan) >= 50


@injects
@each_way
@pytest.mark.parametrize(("signal", "status"), [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)])
def test_a_signal_at_any_rename_leaves_nothing_behind(
    way: str, signal: str, status: int, tmp_path: Path
) -> None:
    plan = [fault for fault in faults("write", tmp_path, prepare, WAYS[way]) if "rename" in fault.call]
    ends = suffer("write", tmp_path, prepare, plan, f"signal={signal}", WAYS[way])
    for number, (fault, end) in enumerate(zip(plan, ends, strict=True)):
        where = tmp_path / str(number)
        assert end.status == status, fault
        assert os.listdir(where) == ["target"], fault
        assert content(where / "target") in ("old", "new"), fault
    assert plan


@injects
@each_way
def test_an_error_at_any_call_is_told_and_what_was_there_stays(way: str, tmp_path: Path) -> None:
    plan = faults("write", tmp_path, prepare, WAYS[way])
    ends = suffer("write", tmp_path, prepare, plan, "error=ENOSPC", WAYS[way])
    message = "target: nothing was written: No space left on device; choose another place"
    for number, (fault, end) in enumerate(zip(plan, ends, strict=True)):
        where = tmp_path / str(number)
        expected = ("new", "") if end.status == 0 else ("old", message)
        assert (left(where, way), end.said) == expected, fault
        assert next_writer_tidies(where), fault
    assert sum(end.status == 2 for end in ends) >= 20


def test_a_writer_who_comes_between_two_renames_keeps_the_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target, work = tmp_path / "target", tmp_path / "work"
    for folder, text in ((target, "old"), (work / "new", "new")):
        folder.mkdir(parents=True)
        (folder / "a").write_text(text)
    rename = Path.rename

    def interrupted(here: Path, there: Path) -> None:
        rename(here, there)
        if here == target:
            target.mkdir()
            (target / "a").write_text("of another")

    monkeypatch.setattr(exchange, "_swapped", lambda *_: False)
    monkeypatch.setattr(Path, "rename", interrupted)
    for taken in (["old"], ["of another", "old"]):
        with pytest.raises(OSError, match="not empty"):
            exchange.exchange(work / "new", target)
        assert (target / "a").read_text() == "of another"
        assert (work / "new/a").read_text() == "new"
        assert not (work / "old/target").exists(), "a sweep would bring it back"
        assert sorted(file.read_text() for file in (work / "rest").rglob("a")) == taken


def test_a_writer_who_comes_and_goes_again_holds_no_other_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target, work = tmp_path / "target", tmp_path / "work"
    for folder, text in ((target, "old"), (work / "new", "new")):
        folder.mkdir(parents=True)
        (folder / "a").write_text(text)
    rename, parked = Path.rename, work / "of another"
    came: list[Path] = []

    def beside_another(here: Path, there: Path) -> None:
        if parked.exists():
            rename(parked, target)  # the second of its two renames
        try:
            rename(here, there)
        except OSError:
            if here == work / "old/target":
                rename(target, parked)  # the first
            raise
        if here == target and not came:
            came.append(here)
            target.mkdir()
            (target / "a").write_text("of another")

    monkeypatch.setattr(exchange, "_swapped", lambda *_: False)
    monkeypatch.setattr(Path, "rename", beside_another)
    assert exchange.publish(work / "new", target)
    assert (target / "a").read_text() == "new"
    assert (work / "new/a").read_text() == "of another"


def test_of_two_writers_at_once_one_wins_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for swap in (exchange._swap, lambda: None):
        monkeypatch.setattr(exchange, "_swap", swap)
        threads = [
            threading.Thread(target=write, args=(tmp_path / "out/target", text), daemon=True)
            for text in map(str, range(8))
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert content(tmp_path / "out/target") in map(str, range(8))
        assert os.listdir(tmp_path / "out") == ["target"]


def test_a_living_writers_workplace_and_what_linkwise_did_not_make_stay(tmp_path: Path) -> None:
    for name in ("mine", ".linkwise-abcdefgh/thesis", ".linkwise-notes"):
        (tmp_path / name).mkdir(parents=True)
    for name in (".linkwise-abcdefgh/lock", ".linkwise-file1234", ".linkwise-notes/lock", "mine/lock"):
        (tmp_path / name).touch()
    (tmp_path / ".linkwise-link5678").symlink_to(tmp_path / "mine")
    before = sorted(tmp_path.rglob("*"))
    with whole_directory(tmp_path / "target", nothing_refused) as draft:
        (draft / "a").touch()
        sweep(tmp_path)
        assert (draft / "a").is_file()
    assert sorted(tmp_path.rglob("*")) == sorted([*before, tmp_path / "target", tmp_path / "target/a"])


def test_what_was_taken_away_comes_back_unless_something_is_there_again(tmp_path: Path) -> None:
    for target in ("gone", "again"):
        dead = tmp_path / f".linkwise-{target:_<8}"
        (dead / "old" / target).mkdir(parents=True)
        (dead / "old" / target / "file").write_text("former")
        (dead / "lock").touch()
    (tmp_path / "again").mkdir()
    (tmp_path / "again/file").write_text("present")
    sweep(tmp_path)
    assert sorted(os.listdir(tmp_path)) == ["again", "gone"]
    assert [(tmp_path / name / "file").read_text() for name in ("again", "gone")] == ["present", "former"]


def test_what_was_added_meanwhile_is_not_deleted(tmp_path: Path) -> None:
    def refuse(target: Path) -> None:
        if (target / "thesis").exists():
            raise LinkwiseError(f"{target} holds a thesis")

    write(tmp_path / "target", "old")
    writer = whole_directory(tmp_path / "target", refuse)
    (writer.__enter__() / "a").touch()
    (tmp_path / "target/thesis").touch()
    with pytest.raises(LinkwiseError, match=f"^{tmp_path / 'target'} holds a thesis"):
        writer.__exit__(None, None, None)
    assert sorted(os.listdir(tmp_path / "target")) == ["a", "b", "c", "sub", "thesis"]
    assert os.listdir(tmp_path) == ["target"]


def write_set(target: Path) -> None:
    write_files(target, {"a": b"new", "b": b"new"})


def listen(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(path))


def write_folder(target: Path) -> None:
    write(target, "new")


@pytest.mark.parametrize("way", [write_folder, write_set, require_writable])
@pytest.mark.parametrize("blocked", ["file/x/target", "file/target", "link/target"])
def test_the_file_that_blocks_is_named(way: Callable[[Path], None], blocked: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    (tmp_path / "link").symlink_to("nowhere")
    blocker = tmp_path / blocked.split("/")[0]
    with pytest.raises(LinkwiseError) as caught:
        way(tmp_path / blocked)
    message = f"{blocker}: nothing was written: it is not a folder; choose another place"
    assert str(caught.value) == message
    assert sorted(os.listdir(tmp_path)) == ["file", "link"]


@pytest.mark.parametrize("way", [write_folder, write_set, require_writable])
@pytest.mark.parametrize("address", ["s3://bucket/results", "file:///results"])
def test_an_address_is_no_folder(
    way: Callable[[Path], None], address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(LinkwiseError, match="that is an address, and results are written to folders"):
        way(Path(address))
    assert not list(tmp_path.iterdir())


def test_the_exchange_that_the_system_has_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Linux calls it otherwise than macOS, and some have none: there the two names are renamed."""
    linux, mac = SimpleNamespace(renameat2=lambda *of: 5), SimpleNamespace(renamex_np=lambda *of: 7)
    found = {}
    for library in (linux, mac, SimpleNamespace()):
        monkeypatch.setattr(exchange.ctypes, "CDLL", lambda _, library=library: library)
        swap = exchange._swap.__wrapped__()
        found[tuple(vars(library))] = swap(b"one", b"other") if swap else None
    assert found == {("renameat2",): 5, ("renamex_np",): 7, (): None}


def test_a_signal_while_a_workplace_is_tidied_up_is_not_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cleared, struck = workplace._cleared, [KeyboardInterrupt()]

    def strike(work: Path) -> None:
        if struck:
            raise struck.pop()
        cleared(work)

    monkeypatch.setattr(workplace, "_cleared", strike)
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path / "target", "new")
    assert os.listdir(tmp_path) == ["target"]


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Ctrl-C as a program meets it that was not started with it ignored."""
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, former)


def test_signals_wait_though_another_thread_takes_them(interruptible: None) -> None:
    """The system gives one that this thread blocks to any other, and Python acts on it in this one."""
    over, steps = threading.Event(), list[str]()
    other = threading.Thread(target=over.wait)

    def struck() -> None:
        with workplace.signals_held():
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.05)
            steps.append("the last")

    other.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            struck()
    finally:
        over.set()
        other.join()
    assert steps == ["the last"]
    assert signal.getsignal(signal.SIGINT) == signal.default_int_handler


def test_an_interrupt_strikes_while_a_draft_is_written(tmp_path: Path, interruptible: None) -> None:
    steps = list[str]()

    def writing() -> None:
        with whole_directory(tmp_path / "target", nothing_refused):
            signal.raise_signal(signal.SIGINT)
            steps.append("one more")

    with pytest.raises(KeyboardInterrupt):
        writing()
    assert (steps, os.listdir(tmp_path)) == ([], [])


def test_a_lock_that_no_try_makes_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened, tries = os.open, iter(range(3))

    def full(path: Path, flags: int, mode: int = 0o777) -> int:
        if Path(path).name == workplace.LOCK:
            next(tries)
            raise OSError(28, "No space left on device")
        return opened(path, flags, mode)

    monkeypatch.setattr(os, "open", full)
    with pytest.raises(LinkwiseError, match="No space left on device"):
        write(tmp_path / "target", "new")


def test_all_of_a_draft_is_on_the_disk_before_it_takes_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path / "target", "old")
    flushed: dict[Path, str] = {}
    system = type(exchange.system_here())
    file = tmp_path / "target" / NAMES[0]
    monkeypatch.setattr(system, "flush", lambda _, place: flushed.update({place: file.read_text()}))
    with whole_directory(tmp_path / "target", nothing_refused) as draft:
        for name in NAMES:
            (draft / name).parent.mkdir(exist_ok=True)
            (draft / name).write_text("new")
    places = {draft, *(draft / name for name in NAMES), *((draft / name).parent for name in NAMES)}
    assert {flushed[place] for place in places} == {"old"}


def test_folders_made_for_a_failed_writer_go_too(tmp_path: Path) -> None:
    (tmp_path / "kept").mkdir()
    with pytest.raises(LinkwiseError), whole_directory(tmp_path / "kept/a/b/target", nothing_refused):
        raise LinkwiseError("the log")
    assert list((tmp_path / "kept").iterdir()) == []


def test_a_set_of_files_is_written_whole_or_not_at_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_files(tmp_path, {"b": b"old"})
    (tmp_path / "c").mkdir()
    with pytest.raises(LinkwiseError, match=f"^{tmp_path / 'c'}: nothing was written: a folder of that name"):
        write_files(tmp_path, dict.fromkeys("abc", b"new"))
    (tmp_path / "c").rmdir()
    replace = os.replace

    def fail_once(source: Path, target: Path) -> None:
        if target.name == "c":
            raise OSError(5, "Input/output error")
        replace(source, target)

    monkeypatch.setattr(os, "replace", fail_once)
    with pytest.raises(LinkwiseError, match="nothing was written: Input/output error"):
        write_files(tmp_path, dict.fromkeys("abc", b"new"))
    assert {file.name: file.read_text() for file in tmp_path.iterdir()} == {"b": "old"}


@pytest.mark.parametrize(
    ("kind", "make"), [("a pipe", os.mkfifo), ("a folder", os.mkdir), ("a socket", listen)]
)
def test_what_is_no_file_in_the_place_of_one_of_a_set_is_named_and_stays(
    kind: str, make: Callable[[Path], None], tmp_path: Path
) -> None:
    make(tmp_path / "b")
    before = (tmp_path / "b").lstat()
    with pytest.raises(LinkwiseError) as caught:
        write_set(tmp_path)
    told = f"nothing was written: {kind} of that name is there; move it away, or choose another place"
    assert str(caught.value) == f"{tmp_path / 'b'}: {told}"
    assert os.listdir(tmp_path) == ["b"]
    assert (tmp_path / "b").lstat() == before


def test_a_workplace_without_locks_is_left_to_its_writer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(workplace, "locked", lambda lock, otherwise: otherwise)
    with whole_directory(tmp_path / "target", nothing_refused) as draft:
        sweep(tmp_path)
        (draft / "a").touch()
    assert os.listdir(tmp_path) == ["target"]


def test_the_current_folder_can_be_the_target(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "target").mkdir()
    monkeypatch.chdir(tmp_path / "target")
    write(Path("."), "new")
    assert content(tmp_path / "target") == "new"
    assert os.listdir(tmp_path) == ["target"]
