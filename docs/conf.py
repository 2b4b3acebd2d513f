"""How Sphinx makes the documentation: `make docs`."""

import re

from linkwise.version import VERSION

project = "linkwise"
release = version = VERSION
author = "linkwise developers"
copyright = "linkwise developers, Apache-2.0"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinxcontrib.typer"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["pictures"]
root_doc = "index"

html_theme = "furo"
html_title = f"linkwise {VERSION}"
html_show_sphinx = False
html_copy_source = False

myst_heading_anchors = 3
myst_links_external_new_tab = False
suppress_warnings: list[str] = []

default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88
add_module_names = False


def _argument_lines(app: object, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Set lines such as `tau: torques (..., n)` of a docstring as a list of arguments."""
    told: list[str] = []
    for line in lines:
        if found := re.match(r"(\w+(?:(?:,| and) \w+)*): (?=\S)", line):
            told += ["", f"**{found[1]}**: {line[found.end() :]}"]
        else:
            told.append(line)
    lines[:] = told


def setup(app: object) -> None:
    """Called by Sphinx."""
    app.connect("autodoc-process-docstring", _argument_lines)  # type: ignore[attr-defined]
