"""Recipes by which conda's tools build both distributions: each says what its pyproject.toml says."""

import hashlib
import sys
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined
from linkwise.errors import LinkwiseError
from packaging.requirements import Requirement
from rattler_build import RattlerBuildError, Stage0Recipe, build_recipes

TEMPLATE = Path(__file__).parent / "conda/recipe.yaml.j2"
OTHER = {"linkwise": "linkwise-runtime", "linkwise-runtime": "linkwise"}
ADDRESSES = {"homepage": "homepage", "repository": "repository", "documentation": "documentation"}
"""Keys of a recipe, by those of [project.urls] in small letters."""


def recipe(project: Path, sources: Path, version: str) -> str:
    """Return the recipe of the project in a folder, whose archive of sources lies beside it.

    Raises LinkwiseError where rattler-build's reader does not take it.
    """
    settings = tomllib.loads((project / "pyproject.toml").read_text(encoding="utf-8"))
    about = settings["project"]
    urls = {key.lower(): address for key, address in about.get("urls", {}).items()}
    values: dict[str, Any] = {
        "name": about["name"],
        "version": version,
        "module": about["name"].replace("-", "_"),
        "other": OTHER[about["name"]],
        "sources": sources.name,
        "sha256": hashlib.sha256(sources.read_bytes()).hexdigest(),
        "scripts": about.get("scripts", {}),
        "python": about["requires-python"],
        "build_needs": matched(settings["build-system"]["requires"]),
        "needs": matched(about["dependencies"]),
        "license": about["license"],
        "summary": about["description"],
        "addresses": {key: urls[own] for own, key in ADDRESSES.items() if own in urls},
    }
    jinja = Environment(undefined=StrictUndefined, keep_trailing_newline=True, autoescape=False)
    text = jinja.from_string(TEMPLATE.read_text(encoding="utf-8")).render(values)
    try:
        Stage0Recipe.from_yaml(text).render()
    except RattlerBuildError as error:
        raise LinkwiseError(f"conda recipe of {about['name']}: {error}") from error
    return text


def matched(requirements: Iterable[str]) -> list[str]:
    """Return requirements as conda writes them; names are the same there."""
    return [f"{need.name} {need.specifier}".strip() for need in map(Requirement, requirements)]


if __name__ == "__main__":  # with recipes, where conda-forge can be reached
    build_recipes([*sys.argv[1:]], channel=["conda-forge"], output_dir="out/conda", package_format="conda")
