"""Run what a page of documentation shows, from top to bottom, in one folder, as a reader would.

    ```sh                 commands, with this installation's `linkwise` on the path
    ```python             Python; the blocks of a page share their names
    ```toml arm.toml      a file of that name
    ```text printed       what the block above prints; lines that are ... stand for any
    ```sh tests/FILE.py   not run here, but by that test; so for any language
    ```text               an excerpt or a formula, which is not run
    <!-- from: PATH -->   the picture below it is the file that the page's commands made at PATH
    <!-- needs: WORD … --> programs without which the page is not run
    <!-- given: FILE … --> files that a reader has: those of GIVEN, or of the blocks of docs/tutorial-robot.md

`python tests/tools/pages.py` runs all pages and brings their pictures up to date; with names of pages, these.
"""

import contextlib
import io
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from conftest import PANDA
from helpers.needed import missing
from markdown_it import MarkdownIt

ROOT = Path(__file__).parents[2]
README = ROOT / "README.md"
PAGES = (README, *sorted({*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")} - {README}))
RUN = ("sh", "python")
GIVEN = {
    "panda.urdf": PANDA,
    "talos.urdf": PANDA.parents[2] / "talos_data/robots/talos_full_v2.urdf",
    "fourbar.toml": ROOT / "tests/data/fourbar.toml",
}
"""Robots that pages speak of, and where they are here."""


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, the word behind it, its text, and the page's line that it starts on."""

    language: str
    word: str
    text: str
    line: int

    @property
    def is_held_elsewhere(self) -> bool:
        """Return whether a test of its own runs it."""
        return self.word.startswith("tests/")

    @property
    def runs(self) -> bool:
        """Return whether it is run with the page."""
        return self.language in RUN and not self.word


def blocks(page: Path) -> Iterator[Block]:
    """The page's blocks of code, fenced or indented (which have no language), in order."""
    for token in MarkdownIt().parse(page.read_text(encoding="utf-8")):
        if token.type in ("fence", "code_block"):
            language, _, word = token.info.strip().partition(" ")
            yield Block(language, word, token.content, (token.map or [0])[0] + 1)


def pictures(page: Path) -> Iterator[tuple[str, Path]]:
    """Pictures that the page's commands make, and the picture of the page that each is."""
    text = page.read_text(encoding="utf-8")
    for made, shown in re.findall(r"<!-- from: (\S+) -->\s*!\[[^\]]*\]\(([^)\s]+)\)", text):
        yield made, page.parent / shown


def words(page: Path, key: str) -> list[str]:
    """Words that the page's comments `<!-- key: … -->` list."""
    found = re.findall(rf"<!-- {key}: (.*?) -->", page.read_text(encoding="utf-8"))
    return " ".join(found).split()


def lacking(page: Path) -> str:
    """Return why the page cannot be run here, and what helps; empty where it can."""
    if absent := missing(*words(page, "needs")):
        return absent
    there = all(GIVEN[name].is_file() for name in words(page, "given") if name in GIVEN)
    return "" if there else "needs real robots: pip install example-robot-data"


def _give(page: Path, folder: Path) -> None:
    tutorial = {block.word: block.text for block in blocks(ROOT / "docs/tutorial-robot.md")}
    for name in words(page, "given"):
        text = GIVEN[name].read_text(encoding="utf-8") if name in GIVEN else tutorial[name]
        (folder / name).write_text(text, encoding="utf-8")


def run_page(page: Path, folder: Path) -> None:
    """Run the page's blocks in the folder; raises AssertionError with the page's line where one fails."""
    names: dict[str, object] = {"__name__": "__page__"}
    printed = ""
    _give(page, folder)
    with contextlib.chdir(folder):
        for block in blocks(page):
            place = f"{page.name}, line {block.line}"
            if block.is_held_elsewhere:
                assert (ROOT / block.word).is_file(), f"{place}: no {block.word}"
            elif block.language == "python" and block.runs:
                printed = _python(block, page, names)
            elif block.language == "sh" and block.runs:
                printed = _shell(block, place)
            elif block.language == "text" and block.word == "printed":
                _compare(block.text, printed, place)
            elif block.word:
                Path(block.word).parent.mkdir(parents=True, exist_ok=True)
                Path(block.word).write_text(block.text, encoding="utf-8")


def _python(block: Block, page: Path, names: dict[str, object]) -> str:
    """Run it in this process, each line counted as it stands on the page."""
    out = io.StringIO()
    code = compile("\n" * block.line + block.text, str(page), "exec")
    sys.path.insert(0, str(Path.cwd()))
    try:
        with contextlib.redirect_stdout(out):
            exec(code, names)
    finally:
        sys.path.pop(0)
    return out.getvalue()


def _shell(block: Block, place: str) -> str:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["sh", "-e", "-c", block.text],
        env=os.environ | {"PATH": path, "COLUMNS": "110"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{place}:\n{done.stdout}\n{done.stderr}"
    return done.stdout


def _compare(shown: str, printed: str, place: str) -> None:
    """Hold what the page shows to what was printed; blanks at the ends of lines do not count."""
    lines = [
        ".*" if line.strip() == "..." else re.escape(line.rstrip()) for line in shown.rstrip().splitlines()
    ]
    found = "\n".join(line.rstrip() for line in printed.rstrip().splitlines())
    assert re.fullmatch("\n".join(lines), found, re.DOTALL), f"{place}: printed was\n{found}"


def main() -> None:
    """Run the pages, or those named, and copy the pictures that they make to where they are shown.

    Each of several has a process of its own, as a page may register a back end.
    """
    named = [Path(name).resolve() for name in sys.argv[1:]]
    if len(named) != 1:
        for page in named or PAGES:
            subprocess.run([sys.executable, __file__, str(page)], check=True)
        return
    (page,) = named
    with tempfile.TemporaryDirectory() as folder:
        print(page.relative_to(ROOT), flush=True)
        run_page(page, Path(folder))
        for made, shown in pictures(page):
            shutil.copyfile(Path(folder, made), shown)


if __name__ == "__main__":
    main()
