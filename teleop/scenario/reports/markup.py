"""Elements of HTML and SVG, in which every text is escaped unless it is an element itself."""

from __future__ import annotations

import html
from typing import Final, TypeAlias

from teleop.scenario.reports.plain_text import plain_text


class Markup(str):
    """A text that is markup already."""

    __slots__ = ()


_VOID: Final = {"meta", "img", "br"}
"""Elements without an end."""

Child: TypeAlias = str | float | None
"""Markup, a text to be escaped, a number, or nothing."""


def element(name: str, /, *children: Child, **attributes: Child | bool) -> Markup:
    """Return an element.

    Args:
        name: Name of the element.
        children: What is inside.
        attributes: Its attributes, a trailing ``_`` left out, as in ``class_``, and ``_`` written as ``-``; those
            that are None or False are left out, and of those that are True the name stands alone.
    """
    words = [name]
    for key, value in attributes.items():
        if value is None or value is False:
            continue
        written = key.rstrip("_").replace("_", "-")
        words.append(written if value is True else f'{written}="{escaped(value)}"')
    if name in _VOID:
        return Markup(f"<{' '.join(words)}>")
    return Markup(f"<{' '.join(words)}>{joined(*children)}</{name}>")


def joined(*children: Child) -> Markup:
    """Return parts one after the other."""
    return Markup("".join(c if isinstance(c, Markup) else escaped(c) for c in children))


def escaped(value: Child) -> str:
    """Return a text or number in which nothing is markup."""
    if value is None:
        return ""
    if isinstance(value, str):
        return html.escape(plain_text(value))
    return f"{value:.6g}"


def preformatted(text: str) -> Markup:
    """Return lines of text as an element that keeps them."""
    return element("pre", Markup("\n".join(escaped(line) for line in text.split("\n"))))
