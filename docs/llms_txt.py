"""Extension of Sphinx that writes llms.txt beside the pages, by the convention of llmstxt.org.

Title and summary are those of the index, sections are the captions of its tables of contents, and each page
is a link with the first sentence of its text. (sphinx-llms-txt 0.7 has neither sections nor notes, and links
sources, of which those of the API say nothing.)
"""

import re
from collections.abc import Iterator
from pathlib import Path

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

SENTENCE_END = re.compile(r"(?<!\b[A-Z])(?<!\bFig)\. ")
"""End of a sentence, and not of an initial or of "Fig." before its number."""


def sections(env: BuildEnvironment) -> Iterator[tuple[str, list[str]]]:
    """Yield each caption of the index with the names of its pages."""
    for contents in env.get_doctree(env.config.root_doc).findall(addnodes.toctree):
        yield contents["caption"], contents["includefiles"]


def first_sentence(env: BuildEnvironment, page: str) -> str:
    """Return the first sentence of a page's text, empty where it has only tables and lists."""
    for paragraph in env.get_doctree(page).findall(nodes.paragraph):
        if isinstance(paragraph.parent, nodes.section):
            return SENTENCE_END.split(" ".join(paragraph.astext().split()))[0].rstrip(".:")
    return ""


def text_of(env: BuildEnvironment, addresses: dict[str, str]) -> str:
    """Return llms.txt; addresses: URL of each page by its name."""
    index = env.get_doctree(env.config.root_doc)
    opening = index.next_node(nodes.paragraph)
    assert opening, "the index says in a paragraph what linkwise is"
    lines = [f"# {env.config.project}", "", f"> {' '.join(opening.astext().split())}"]
    for caption, pages in sections(env):
        lines += ["", f"## {caption}", ""]
        for page in pages:
            told = first_sentence(env, page)
            lines.append(f"- [{env.titles[page].astext()}]({addresses[page]}){told and f': {told}'}")
    return "\n".join([*lines, ""])


def write(app: Sphinx, failed: Exception | None) -> None:
    """Write llms.txt into the folder of a site."""
    if failed or app.builder.name != "html":
        return
    addresses = {
        page: app.config.html_baseurl + app.builder.get_target_uri(page) for page in app.env.found_docs
    }
    Path(app.outdir, "llms.txt").write_text(text_of(app.env, addresses), encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.connect("build-finished", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
