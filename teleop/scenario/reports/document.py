"""Pieces that all pages share: the document itself, sections and tables; every text in it is escaped."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Final

from teleop.scenario.reports.markup import Child, Markup, element

_POLICY: Final = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
"""Nothing is loaded and nothing is run, whatever a text from the wire holds."""


def document(title: str, *body: Child, style: str = "") -> str:
    """Return an HTML file without script and without parts from elsewhere.

    Args:
        title: Its title.
        body: What is in it.
        style: Further rules of style.
    """
    sheet = Path(__file__).with_name("page.css").read_text(encoding="utf-8")
    head = element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", http_equiv="Content-Security-Policy", content=_POLICY),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("meta", name="color-scheme", content="light dark"),
        element("title", title),
        element("style", Markup(sheet + style)),
    )
    return f'<!doctype html>\n<html lang="en">{head}\n{element("body", *body)}</html>\n'


def section(title: str, *content: Child) -> Markup:
    """Return a section with its title."""
    return element("section", element("h2", title), *content)


def number_cell(text: str) -> Markup:
    """Return a cell of a table whose digits stand below each other."""
    return element("td", text, class_="n")


def table(head: Iterable[str], rows: Iterable[Iterable[Child]], name: str = "") -> Markup:
    """Return a table that can be moved sideways where it is wider than the screen."""
    body = [element("tr", *(_cell(cell) for cell in row)) for row in rows]
    titles = element("thead", element("tr", *(element("th", title) for title in head)))
    return element(
        "div", element("table", titles, element("tbody", *body)), class_=f"wide {name}".rstrip()
    )


def _cell(cell: Child) -> Markup:
    is_cell = isinstance(cell, Markup) and cell.startswith("<td")
    return Markup(cell) if is_cell else element("td", cell)
