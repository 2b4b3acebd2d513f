"""Public faces that are checked in, release/api/VERSION.json; `make api` writes that of this version."""

from collections.abc import Iterator
from pathlib import Path

from griffe import Breakage, Module, Parameter, find_breaking_changes

from release.checkout import is_breaking_told, numbers, version_of
from release.public_face import public_face, read, written

FOLDER = "release/api"


def recorded(root: Path) -> dict[str, Path]:
    """Return the files of faces by their versions, the oldest first."""
    files = {path.stem: path for path in (root / FOLDER).glob("*.json")}
    return dict(sorted(files.items(), key=lambda item: numbers(item[0])))


def broken(old: Path, new: Module) -> list[str]:
    """Return the changes that break whoever uses a face that is recorded, a line each."""
    return [line(change) for change in find_breaking_changes(read(old), new)]


def line(change: Breakage) -> str:
    """Return what has changed: its path, the parameter, and griffe's word for it."""
    values = (change.old_value, change.new_value)
    [parameter, *_] = [f"({value.name})" for value in values if isinstance(value, Parameter)] or [""]
    return f"{change.obj.path.removeprefix('public.')}{parameter}: {change.kind.value.lower()}"


def untold(root: Path, face: Module) -> list[str]:
    """Return the changes since the newest recorded face that break its users, unless they are told.

    A fragment changes/NAME.breaking.md tells them, or a heading of the changelog that has the word.
    """
    if is_breaking_told(root, version_of(root)):
        return []
    return broken(list(recorded(root).values())[-1], face)


def objections(root: Path, face: Module) -> Iterator[str]:
    """Yield what in the public face speaks against a release, and how it is mended."""
    version, files = version_of(root), recorded(root)
    own = root / FOLDER / f"{version}.json"
    if not own.is_file() or own.read_text(encoding="utf-8") != written(face):
        yield f"{FOLDER}/{version}.json: is not the public face of this checkout; run make api, and commit it"
    earlier = [name for name in files if numbers(name) < numbers(version)]
    changes = broken(files[earlier[-1]], face) if earlier else []
    if changes and not is_breaking_told(root, version):
        mend = "tell it below a heading `### Breaking` of CHANGELOG.md, or take it back"
        yield from (f"{change}, which breaks users of {earlier[-1]}; {mend}" for change in changes)
    if changes and not may_break(earlier[-1], version):
        yield f"{version} breaks users of {earlier[-1]}, which needs a rise of more than the last number"


def may_break(earlier: str, version: str) -> bool:
    """Return whether a version may break an earlier one's users: by its first number, or 0 and its second."""
    old, new = numbers(earlier), numbers(version)
    return new[0] > old[0] or (new[0] == 0 and new[1] > old[1])


def record(root: Path) -> None:
    """Write the face of a checkout below its version."""
    place = root / FOLDER / f"{version_of(root)}.json"
    place.write_text(written(public_face(root)), encoding="utf-8")


if __name__ == "__main__":
    record(Path(__file__).parents[1])
