"""Make all that a release hands out, up to the upload: `make release`, or `make rehearsal` at any time.

A rehearsal makes the same of the last commit; what speaks against a release is told, and does not end it.
"""

import argparse
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from linkwise.errors import LinkwiseError

from release import archives, checkout, conda_recipe, materials, public_face, recorded_faces

ROOT = Path(__file__).parents[1]
OUT = ROOT / "out/release"


def main(arguments: Sequence[str] | None = None) -> int:
    """Return the exit status: 2 where something speaks against a release, and out/release is as it was."""
    parser = argparse.ArgumentParser(prog="python -m release", description=__doc__)
    parser.add_argument("--rehearse", action="store_true", help="tell what speaks against it, and go on")
    asked = parser.parse_args(arguments)
    try:
        checkout.version_of(ROOT)
        face = public_face.public_face(ROOT)
        against = [*checkout.objections(ROOT), *recorded_faces.objections(ROOT, face)]
        for line in against:
            print(f"release: {line}", file=sys.stderr)
        if against and not asked.rehearse:
            return 2
        with tempfile.TemporaryDirectory(prefix="linkwise-release-") as work:
            make(public_face.written(face), Path(work))
    except LinkwiseError as error:
        print(f"release: error: {error}", file=sys.stderr)
        return 2
    print(told(checkout.version_of(ROOT), is_rehearsal=bool(against)))
    return 0


def make(face: str, work: Path) -> None:
    """Make every file of the release in a folder; out/release is replaced when all are there."""
    version, epoch = checkout.version_of(ROOT), checkout.epoch(ROOT)
    target = work / "release"
    target.mkdir()
    files = archives.twice(ROOT, work, target, epoch)
    archives.checked(files, version)
    (target / f"linkwise-{version}.api.json").write_text(face, encoding="utf-8")
    tree = work / "first/tree"
    for project, sources, wheel in zip(archives.PROJECTS, files[::2], files[1::2], strict=True):
        name = wheel.name.split("-")[0]
        bill = target / f"{name}-{version}.cdx.json"
        materials.bill(wheel, tree / project, ROOT / "constraints.txt", bill, work, epoch)
        place = target / f"{name.replace('_', '-')}.recipe.yaml"
        place.write_text(conda_recipe.recipe(tree / project, sources, version), encoding="utf-8")
    notes = (checkout.section(ROOT, version) or "").strip()
    (target / "NOTES.md").write_text(f"{notes}\n", encoding="utf-8")
    (target / "SHA256SUMS").write_text(archives.sums(target), encoding="utf-8")
    shutil.rmtree(OUT, ignore_errors=True)
    shutil.copytree(target, OUT)


def told(version: str, is_rehearsal: bool) -> str:
    """Return what was made, and what is left to press."""
    made = (OUT / "SHA256SUMS").read_text(encoding="utf-8")
    if is_rehearsal:
        return f"{made}out/release: a rehearsal, and no release, as said above"
    return (
        f"{made}out/release: linkwise {version}, the same bytes twice. Nothing is uploaded. Press:\n"
        f"  git tag --annotate v{version} --message 'linkwise {version}'\n"
        f"  git push origin v{version}\n"
        "The workflow `release` then makes the same files and waits for a maintainer to let it publish."
    )


if __name__ == "__main__":
    sys.exit(main())
