"""Pages from templates: one HTML file each, without script and without parts from elsewhere."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from localization.report.plain_text import plain_text


def rendered(template: str, **values: object) -> str:
    """Return a page; each text in it is escaped, whatever it holds, unless it is ``Markup``.

    Args:
        template: Its template, beside the packages: ``localization/report/localized_log.html``.
        values: What the template names.
    """
    return _templates().get_template(template).render(values)


@cache
def _templates() -> Environment:
    templates = Environment(
        loader=FileSystemLoader(Path(__file__).parents[2]),
        autoescape=True,
        finalize=_shown,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters["lines"] = _lines
    return templates


def _shown(value: object) -> object:
    """Return what a template shows of a value: of a text one line that controls nothing."""
    if isinstance(value, Markup):
        return value
    return plain_text(value) if isinstance(value, str) else value


def _lines(text: str) -> Markup:
    """Return a text of many lines, which ``_shown`` would join."""
    return Markup("\n").join(map(plain_text, text.split("\n")))
