"""Public faces that are checked in, release/api/VERSION.json; `make api` writes that of this version.

Where a version is tagged, its face is the one in the tag, whatever the file says now.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

from griffe import Breakage, Module, Parameter, find_breaking_changes
from linkwise.errors import LinkwiseError

from release.checkout import VERSION, git, is_breaking_told, numbers, tags, version_of
from release.public_face import public_face, read, written

FOLDER = "release/api"


def recorded(root: Path) -> dict[str, str]:
    """Return the faces by their versions, the oldest first: those in tags, and files for other versions."""
    faces = {path.stem: path.read_text(encoding="utf-8") for path in (root / FOLDER).glob("*.json")}
    return dict(sorted((faces | tagged(root)).items(), key=lambda item: numbers(item[0])))


def tagged(root: Path) -> dict[str, str]:
    """Return the faces in tags of versions."""
    named = {version: f"{tag}:{place_of(version)}" for version, tag in tags(root).items()}
    return {
        version: git(root, "show", place).decode()
        for version, place in named.items()
        if git(root, "ls-tree", "--name-only", *place.split(":"))
    }


def place_of(version: str) -> str:
    """Return the file of a version's face, from the root."""
    return f"{FOLDER}/{version}.json"


def broken(old: str, new: Module) -> list[str]:
    """Return the changes that break whoever uses a face that is recorded, a line each."""
    return [line(change) for change in find_breaking_changes(read(old), new)]


def line(change: Breakage) -> str:
    """Return what has changed: its path, the parameter, and griffe's word for it."""
    values = (change.old_value, change.new_value)
    [parameter, *_] = [f"({value.name})" for value in values if isinstance(value, Parameter)] or [""]
    return f"{change.obj.path.removeprefix('public.')}{parameter}: {change.kind.value.lower()}"


def untold(root: Path, face: Module) -> list[str]:
    """Return the changes since the newest recorded face that break its users, unless they are told.

    A fragment changes/NAME.breaking.md tells them, or what stands below `### Breaking` in the changelog.
    """
    if is_breaking_told(root, version_of(root)):
        return []
    return broken(list(recorded(root).values())[-1], face)


def objections(root: Path, face: Module) -> Iterator[str]:
    """Yield what in the public face speaks against a release, and how it is mended."""
    version = version_of(root)
    own = root / place_of(version)
    if not own.is_file() or own.read_text(encoding="utf-8") != written(face):
        yield f"{place_of(version)}: is not the public face of this checkout; run make api, and commit it"
    yield from rewritten(root)
    faces = recorded(root)
    earlier = [name for name in faces if numbers(name) < numbers(version)]
    changes = broken(faces[earlier[-1]], face) if earlier else []
    if changes and not is_breaking_told(root, version):
        mend = "tell it below a heading `### Breaking` of CHANGELOG.md, or take it back"
        yield from (f"{change}, which breaks users of {earlier[-1]}; {mend}" for change in changes)
    if changes and not may_break(earlier[-1], version):
        yield f"{version} breaks users of {earlier[-1]}, which needs a rise of more than the last number"


def rewritten(root: Path) -> Iterator[str]:
    """Yield each face that is no longer the one in its version's tag."""
    for version, face in tagged(root).items():
        file = root / place_of(version)
        if not file.is_file() or file.read_text(encoding="utf-8") != face:
            mend = f"git checkout v{version} -- {place_of(version)}"
            yield f"{place_of(version)}: is not the face that v{version} has; run {mend}, and commit it"


def may_break(earlier: str, version: str) -> bool:
    """Return whether a version may break an earlier one's users: by its first number, or 0 and its second."""
    old, new = numbers(earlier), numbers(version)
    return new[0] > old[0] or (new[0] == 0 and new[1] > old[1])


def record(root: Path) -> None:
    """Write the face of a checkout below its version; raises LinkwiseError for one that is tagged."""
    version = version_of(root)
    if version in tags(root):
        raise LinkwiseError(
            f"{VERSION}: version {version} is tagged, and its face stays; raise VERSION first"
        )
    (root / place_of(version)).write_text(written(public_face(root)), encoding="utf-8")


def main(root: Path) -> int:
    """Return the exit status of `make api`."""
    try:
        record(root)
    except LinkwiseError as error:
        print(f"api: error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(__file__).parents[1]))
