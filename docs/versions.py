"""Build the pages of this version beside those of others, and what leads from one to another: `make docs`.

FOLDER/0.2.0/          pages of a version; what was there before stays
FOLDER/latest/         for each page of the newest version, one that leads there
FOLDER/versions.json   all versions, the newest first, from which pages offer the others
FOLDER/index.html      leads to the newest; llms.txt is the newest's
"""

import html
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

from linkwise_runtime.version import VERSION

LEADING = """<!DOCTYPE html>
<meta charset="utf-8">
<title>linkwise</title>
<link rel="canonical" href="{to}">
<meta http-equiv="refresh" content="1; url={to}">
<script>location.replace("{to}" + location.search + location.hash)</script>
<p>This page is <a href="{to}">{to}</a>.</p>
"""


def versions(folder: Path) -> list[str]:
    """Return the versions whose pages are in a folder, the newest first."""
    found = (path.parent.name for path in folder.glob("*/index.html"))
    numbers = {name: [*map(int, name.split("."))] for name in found if re.fullmatch(r"\d+(\.\d+)+", name)}
    return sorted(numbers, key=numbers.__getitem__, reverse=True)


def lead(folder: Path) -> None:
    """Write what leads to the newest of a folder's versions, and their list."""
    names = versions(folder)
    newest = folder / names[0]
    shutil.rmtree(folder / "latest", ignore_errors=True)
    for page in newest.rglob("*.html"):
        inner = page.relative_to(newest)
        place = folder / "latest" / inner
        place.parent.mkdir(parents=True, exist_ok=True)
        _leading(place, f"{'../' * len(inner.parts)}{names[0]}/{inner.as_posix()}")
    _leading(folder / "index.html", f"{names[0]}/index.html")
    shutil.copyfile(newest / "llms.txt", folder / "llms.txt")
    (folder / "versions.json").write_text(json.dumps(names) + "\n", encoding="utf-8")


def _leading(place: Path, to: str) -> None:
    place.write_text(LEADING.format(to=html.escape(to)), encoding="utf-8")


def main(folder: Path) -> int:
    """Build; exit status 1 where Sphinx warns of anything, and then nothing leads there."""
    build = [sys.executable, "-m", "sphinx", "--quiet", "--fail-on-warning", "--keep-going"]
    done = subprocess.run([*build, str(Path(__file__).parent), str(folder / VERSION)], check=False)
    if done.returncode == 0:
        lead(folder)
    return done.returncode


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
