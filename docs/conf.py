"""Settings by which Sphinx makes the documentation: `make docs`."""

import re
import sys
from pathlib import Path

import sphinxcontrib.typer
from linkwise.cli.app import command_of
from linkwise_runtime.version import VERSION
from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).parents[1]))  # for generated.planar3
sphinxcontrib.typer.get_typer_command = command_of  # so that pages show options as `--help` does

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
html_static_path = ["_static"]
html_css_files = ["width.css"]

smartquotes = False  # they make an en dash of the hyphens of --parameters
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


def _as_they_stand(app: object, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Set lines such as `tau: torques (..., n)` as a list of arguments, and what is indented as it stands."""
    told: list[str] = []
    indented = False
    for line in lines:
        if line.startswith("    ") and not indented:
            told += ["", "::", ""]
        elif indented and line and not line.startswith("    "):
            told.append("")
        indented = line.startswith("    ") or (indented and not line)
        found = re.match(r"(\w+(?:, \w+)*): (?=\S)", line)
        told += ["", f"**{found[1]}**: {line[found.end() :]}"] if found else [line]
    lines[:] = told


def setup(app: Sphinx) -> None:
    """Called by Sphinx."""
    app.connect("autodoc-process-docstring", _as_they_stand)
