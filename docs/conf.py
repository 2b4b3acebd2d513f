"""Settings by which Sphinx makes the documentation: `make docs`."""

import re
import sys
import tomllib
from pathlib import Path

import sphinxcontrib.typer
from linkwise.cli.app import command_of
from linkwise_runtime.version import VERSION
from sphinx.application import Sphinx

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS.parent), str(DOCS)]  # for generated.planar3, and llms_txt
sphinxcontrib.typer.get_typer_command = command_of  # so that pages show options as `--help` does

project = "linkwise"
release = version = VERSION
told = tomllib.loads((DOCS.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
author = ", ".join(one["name"] for one in told["authors"])
copyright = f"{author}, Apache-2.0"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinxcontrib.typer", "llms_txt"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["pictures"]
root_doc = "index"

html_theme = "furo"
html_title = f"linkwise {VERSION}"
html_show_sphinx = False
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["width.css", "versions.css"]
html_js_files = [("versions.js", {"defer": "defer"})]
html_baseurl = f"{told['urls']['Documentation']}/{VERSION}/"
templates_path = ["_templates"]
sidebar = [f"sidebar/{part}.html" for part in ("search", "scroll-start", "navigation", "scroll-end")]
html_sidebars = {"**": ["sidebar/brand.html", "versions.html", *sidebar]}

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
