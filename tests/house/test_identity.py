"""Authors, keywords and URLs are written in pyproject.toml, and everything else has them from there."""

import os
import shutil
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.installation import copied
from tools import identity

OTHER = identity.Identity(
    {
        "authors": [
            {"name": "Ada Łódź", "email": "ada@arms.test"},
            {"name": "B. C.", "email": "b@arms.test"},
        ],
        "keywords": ["arms", 'with "quotes"'],
        "classifiers": ["Typing :: Typed"],
        "urls": {name: f"https://{name.lower()}.arms.test/a" for name in identity.identity_of().urls},
    }
)


def texts(folder: Path) -> Iterator[tuple[Path, str]]:
    """Yield every file that is text, with its text."""
    for place, _, names in os.walk(folder):
        for path in (Path(place, name) for name in names):
            data = path.read_bytes()
            if b"\0" not in data:
                yield path, data.decode(encoding="utf-8", errors="replace")


def test_every_place_has_what_pyproject_toml_says() -> None:
    own = identity.identity_of()
    assert own.names
    assert {"Homepage", "Documentation", "Source", "Issues"} <= set(own.urls)
    for path, text in identity.written(own, identity.ROOT).items():
        assert path.read_text(encoding="utf-8") == text, f"{path}: run make identity"


def test_no_url_nor_address_of_the_project_stands_elsewhere(tmp_path: Path) -> None:
    folder = copied(tmp_path / "checkout")
    own = identity.identity_of(folder)
    for path, text in identity.written(OTHER, folder).items():
        path.write_text(text, encoding="utf-8")
    (folder / "pyproject.toml").unlink()
    ours = (*own.urls.values(), own.address)
    assert not [path for path, text in texts(folder) if any(word in text for word in ours)]


def test_another_identity_comes_to_all_places_and_back(tmp_path: Path) -> None:
    for file in {place.file for place in identity.places(OTHER)}:
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(identity.ROOT / file, tmp_path / file)
    for asked in (OTHER, identity.identity_of()):
        for path, text in identity.written(asked, tmp_path).items():
            path.write_text(text, encoding="utf-8")
        runtime = tomllib.loads((tmp_path / identity.RUNTIME).read_text(encoding="utf-8"))["project"]
        assert {key: runtime[key] for key in OTHER.project} == {k: asked.project[k] for k in OTHER.project}
    for path in identity.written(OTHER, tmp_path):
        assert path.read_bytes() == (identity.ROOT / path.relative_to(tmp_path)).read_bytes()


def test_a_place_that_is_gone_or_there_twice_is_told() -> None:
    place = identity.Place("a.md", "E-mail: ", "x@y.test")
    assert place.told("a\nE-mail: old\nb\n") == "a\nE-mail: x@y.test\nb\n"
    for text, count in (("a\n", 0), ("E-mail: 1\nE-mail: 2\n", 2)):
        with pytest.raises(ValueError, match=f"^a.md: {count} lines begin with 'E-mail: '; one has to$"):
            place.told(text)


def test_placeholders_are_told_until_they_are_set(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    held = replace(OTHER, project=OTHER.project | {"urls": {"Source": "https://arms.example/x"}})
    assert held.placeholders == ["https://arms.example/x"]
    assert not OTHER.placeholders
    identity.main([str(copied(tmp_path / "checkout"))])
    told = capsys.readouterr().out.splitlines()
    assert [line.split(": ")[1].split(" ")[0] for line in told] == identity.identity_of().placeholders
