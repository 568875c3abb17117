"""Texts from the wire for terminals and files: without characters that control what shows them."""

from __future__ import annotations

import unicodedata
from typing import Final

_CONTROLS: Final = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}
"""Unicode categories of controls, marks of direction, halves of surrogates, and characters of no meaning."""
_REPLACEMENT: Final = "\N{REPLACEMENT CHARACTER}"


def plain_text(text: str) -> str:
    """Return a text in one line, in which what controls a terminal or turns the direction of writing is replaced."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(_shown(c) for c in text)


def _shown(character: str) -> str:
    category = unicodedata.category(character)
    if character in "\t\n\r" or category == "Zs":
        return " "
    return _REPLACEMENT if category in _CONTROLS else character
