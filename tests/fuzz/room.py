"""Place where a case runs, and the watch over what it does to files elsewhere."""

import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fuzz.case import Case

CHANGES = {"os.mkdir": 1, "os.rmdir": 1, "os.remove": 1, "os.rename": 2, "os.link": 2, "os.symlink": 2}
CHANGES |= {"os.truncate": 1, "os.chmod": 1}
"""Events of Python's that change files, and how many paths they begin with."""
FORBIDDEN = {"subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "socket.connect"}


class Room:
    """A folder for a case's files, working directory and target, looked over after it."""

    def __init__(self, root: Path, robot: Path) -> None:
        self.root, self.robot = root, robot
        self.places = {name: root / name for name in ("in", "work", "tmp", "home")}

    def fill(self, case: Case) -> list[str]:
        shutil.rmtree(self.root, ignore_errors=True)
        for place in self.places.values():
            place.mkdir(parents=True)
        if case.copied:
            shutil.copytree(self.robot, self.root / "in" / "package")
        for name, content in case.files.items():
            (self.root / "in" / name).write_bytes(content)
        os.chdir(self.places["work"])
        tempfile.tempdir = str(self.places["tmp"])
        words = {"{in}": "in", "{out}": "out"}
        arguments = list(case.arguments)
        for word, place in words.items():
            arguments = [argument.replace(word, str(self.root / place)) for argument in arguments]
        return [argument.replace("{robot}", str(self.robot)) for argument in arguments]

    def left_behind(self, status: int | None) -> Iterator[str]:
        kept = self.places["home"] / "packages"  # robots' packages, and their lock
        allowed = {self.root / "in", self.root / "out", kept}
        for file in self.root.rglob("*"):
            if file not in self.places.values() and not allowed & {file, *file.parents}:
                yield f"left {file.relative_to(self.root)} behind"
        for file in (self.root / "in").glob(".*"):
            yield f"left in/{file.name} behind"
        if status == 2 and (self.root / "out").exists():
            yield "wrote something and failed"


class Watch:
    """Files that the process opens for writing outside its room, and programs that it starts."""

    def __init__(self) -> None:
        self.inside: str | None = None
        self.seen: list[str] = []
        sys.addaudithook(self._hear)

    def _hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        if self.inside is None:
            return
        if event == "open":
            path, mode, flags = arguments
            written = (
                flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT) if mode is None else set(mode) & set("wax+")
            )
            paths = [path] if written else []
        elif event in CHANGES:
            paths = list(arguments[: CHANGES[event]])
        elif event in FORBIDDEN:
            self.seen.append(f"{event} {arguments[0]!r}")
            return
        else:
            return
        for path in paths:
            if isinstance(path, str | bytes | os.PathLike):
                place = os.path.abspath(os.fsdecode(path))
                if place not in (self.inside, "/dev/null") and not place.startswith(self.inside + os.sep):
                    self.seen.append(f"{event} {os.fsdecode(path)}")
