"""Bring authors, keywords, classifiers and URLs of pyproject.toml to all other places: `make identity`.

A place is a line of a file, told by how it begins, so that it is found whatever stood behind.
"""

import json
import sys
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
RUNTIME = "generator/linkwise_runtime/pyproject.toml"
LABEL = "LABEL org.opencontainers.image."
PLACEHOLDER = ".example"
"""Top-level domain that RFC 2606 keeps for placeholders."""


@dataclass(frozen=True)
class Identity:
    """Makers of linkwise and its places on the web: `[project]` of its pyproject.toml."""

    project: dict[str, Any]

    @property
    def names(self) -> list[str]:
        """Names of the authors."""
        return [author["name"] for author in self.project["authors"]]

    @property
    def address(self) -> str:
        """E-mail address of the first author, to which faults of security and of conduct are told."""
        return str(self.project["authors"][0]["email"])

    @property
    def urls(self) -> dict[str, str]:
        """URLs by their labels."""
        return dict(self.project["urls"])

    @property
    def placeholders(self) -> list[str]:
        """URLs and addresses that nobody can own."""
        hosts = {url: url.split("/")[2] for url in self.urls.values()} | {self.address: self.address}
        return [text for text, host in hosts.items() if host.endswith(PLACEHOLDER)]


@dataclass(frozen=True)
class Place:
    """A line of a file: how it begins, which no other line of the file does, and what follows."""

    file: str
    start: str
    rest: str

    def told(self, text: str) -> str:
        """Return the file's text with this line as told; raises ValueError unless there is one such line."""
        lines = text.splitlines(keepends=True)
        found = [number for number, line in enumerate(lines) if line.startswith(self.start)]
        if len(found) != 1:
            raise ValueError(f"{self.file}: {len(found)} lines begin with {self.start!r}; one has to")
        lines[found[0]] = f"{self.start}{self.rest}\n"
        return "".join(lines)


def identity_of(folder: Path = ROOT) -> Identity:
    """Return the identity that a checkout's pyproject.toml says."""
    return Identity(tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))["project"])


def _inline(table: dict[str, str]) -> str:
    return f"{{ {', '.join(f'{key} = {_text(value)}' for key, value in table.items())} }}"


def _text(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)


def places(identity: Identity) -> Iterator[Place]:
    """Yield every line of another file that has something of the identity."""
    urls, authors = identity.urls, identity.project["authors"]
    yield Place(RUNTIME, "authors = ", f"[{', '.join(map(_inline, authors))}]")
    yield Place(RUNTIME, "keywords = ", _text(identity.project["keywords"]))
    yield Place(RUNTIME, "classifiers = ", _text(identity.project["classifiers"]))
    yield Place(RUNTIME, "urls = ", _inline(urls))
    yield Place("CITATION.cff", "authors: ", _text(authors))
    yield Place("CITATION.cff", "keywords: ", _text(identity.project["keywords"]))
    yield Place("CITATION.cff", "url: ", _text(urls["Homepage"]))
    yield Place("CITATION.cff", "repository-code: ", _text(urls["Source"]))
    yield Place(".github/ISSUE_TEMPLATE/config.yml", "    url: ", urls["Documentation"])
    for file in ("SECURITY.md", "CODE_OF_CONDUCT.md"):
        yield Place(file, "E-mail: ", identity.address)
    for label, value in (("authors", ", ".join(identity.names)), ("url", urls["Homepage"])):
        yield Place("Containerfile", f"{LABEL}{label}=", _text(value))
    for label in ("documentation", "source"):
        yield Place("Containerfile", f"{LABEL}{label}=", _text(urls[label.capitalize()]))
    names = " and ".join(f"{{{name}}}" for name in identity.names)
    yield Place("generator/linkwise/citations.py", "AUTHORS = ", _text(names))


def written(identity: Identity, folder: Path) -> dict[Path, str]:
    """Return the texts that a checkout's files ought to have, by path."""
    texts: dict[Path, str] = {}
    for place in places(identity):
        path = folder / place.file
        texts[path] = place.told(texts.get(path) or path.read_text(encoding="utf-8"))
    return texts


def main(folders: Iterable[str]) -> None:
    """Write the places of a checkout, this one where none is named, and say what are placeholders still."""
    for folder in [Path(name) for name in folders] or [ROOT]:
        identity = identity_of(folder)
        for path, text in written(identity, folder).items():
            path.write_text(text, encoding="utf-8")
        for placeholder in identity.placeholders:
            print(f"{folder / 'pyproject.toml'}: {placeholder} is a placeholder")


if __name__ == "__main__":
    main(sys.argv[1:])
