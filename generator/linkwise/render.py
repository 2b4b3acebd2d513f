"""The one place that uses Jinja2."""

from collections.abc import Mapping
from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, meta

from linkwise.escape import html_text, markdown


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("linkwise.templates", ""),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"html_text": html_text, "markdown": markdown}
    return environment


def render(template: str, view: Mapping[str, Any]) -> str:
    """Return the text of `templates/<template>` with the fields of `view`; a missing field raises."""
    return _environment().get_template(template).render(view)


def variables(template: str) -> set[str]:
    """Return the names that a template needs, for the test that they are its view's fields."""
    environment = _environment()
    source, _, _ = environment.loader.get_source(environment, template)  # type: ignore[union-attr]
    return meta.find_undeclared_variables(environment.parse(source))
