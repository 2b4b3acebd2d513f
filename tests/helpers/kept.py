"""Results of compilers and analysers, kept by their input: a success that is kept is the same success."""

import hashlib
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from linkwise_runtime.native.compiler import processor

RunAll = Callable[[Sequence[Sequence[str]], Callable[[str], None]], None]

CACHE = Path(os.environ.get("LINKWISE_TEST_CACHE") or tempfile.mkdtemp()) / "compiled"
"""`make test` keeps it between runs."""


def run_kept(
    command: Sequence[str | Path], target: Path | None = None, folder: Path | None = None, named: bool = True
) -> None:
    """Run a compiler or an analyser in a folder, unless the same one was given the same texts before.

    It has `-o target`, where a target is given, and all that it writes beside it is kept and is there again.
    Not `named`, a target in the folder is what it makes there by itself.
    Raise AssertionError with what it says where it fails; nothing is kept then.
    """
    words = [str(word) for word in command]
    kept = _place(words, target, folder or Path.cwd())
    if not kept.is_dir():
        with _made(kept) as made:
            out = ["-o", str(made / target.name)] if target is not None and named else []
            done = subprocess.run([*words, *out], cwd=folder, capture_output=True, text=True, check=False)
            assert done.returncode == 0, (words, done.stderr, done.stdout)
            if target is not None and not named:
                shutil.move(target, made)
    if target is not None:
        _restore(kept, target)


def keeping(run_all: RunAll) -> RunAll:
    """Return what runs those of the commands, each of which ends with `-o target`, that no run had before."""

    def run(commands: Sequence[Sequence[str]], tell: Callable[[str], None]) -> None:
        missing = []
        try:
            for command in commands:
                *words, _, target = command
                kept = _place(words, Path(target), Path.cwd())
                if kept.is_dir():
                    _restore(kept, Path(target))
                else:
                    missing.append((command, kept))
        except (
            OSError,
            subprocess.CalledProcessError,
        ):  # none at all: who runs it has words for that
            return run_all(commands, tell)
        run_all([command for command, _ in missing], tell)
        for command, kept in missing:
            if Path(command[-1]).is_file():
                with _made(kept) as made:
                    shutil.copy(command[-1], made)

    return run


def _place(words: Sequence[str], target: Path | None, folder: Path) -> Path:
    """Return the folder for what a command makes, by its program, words, and all texts that it may read."""
    program = Path(shutil.which(words[0]) or words[0])
    found, ending = program.stat(), None if target is None else target.suffix
    heads = (str(program), found.st_size, found.st_mtime_ns, version_of(program), processor(), ending)
    digest = hashlib.sha256(repr(heads).encode())
    for part in _told(words, folder):
        digest.update(len(part).to_bytes(8) + part)
    return CACHE / digest.hexdigest()[:32]


@contextmanager
def _made(kept: Path) -> Iterator[Path]:
    """Yield a folder, which is kept whole if nothing fails."""
    CACHE.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=CACHE) as place:
        made = Path(place) / "made"
        made.mkdir()
        yield made
        with suppress(OSError):  # another process was first
            made.rename(kept)


def _restore(kept: Path, target: Path) -> None:
    for path in kept.iterdir():
        shutil.copy(path, target.with_name(f"{target.stem}{path.suffix}"))


def _told(words: Sequence[str], folder: Path) -> Iterator[bytes]:
    """Yield the words, and of files and folders among them or in them, in place of where they are, the texts.

    A file may include all C files and headers in its folder and below, and in a folder that is named.
    """
    for word in words:
        named = re.search(r'/[^"]*', word)
        path = Path(named[0]) if named else folder / word
        if not path.exists():
            yield word.encode()
            continue
        yield word.replace(str(path), path.name).encode()
        if path.is_file():
            yield path.read_bytes()
        if path.is_dir() or path.suffix in (".c", ".cpp"):
            below = path if path.is_dir() else path.parent
            for text in sorted(below.rglob("*.[ch]")):
                yield str(text.relative_to(below)).encode()
                yield text.read_bytes()


@cache
def version_of(tool: Path) -> str:
    """Return what a compiler or an analyser says of itself."""
    return subprocess.run([tool, "--version"], capture_output=True, text=True, check=True).stdout
