"""Lines of the fields in the text of a TOML file, for messages; ``tomllib`` does not keep them."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from typing import Final

FieldPath = tuple[str | int, ...]
"""Names of fields and indices of lists that lead to a field, such as ``("mission", "goals", 1, "at")``."""

_BLANK: Final = re.compile(r"(?:[ \t\r\n]+|#[^\n]*)*")
"""Blanks, line ends and comments."""
_PART: Final = re.compile(r"""[A-Za-z0-9_-]+|"(?:[^"\\\n]|\\.)*"|'[^'\n]*'""")
"""One part of a key: bare, or quoted in either way."""
_STRING: Final = re.compile(
    r'"""(?:[^"\\]|\\[\s\S]|"(?!""))*"{3,5}'
    r"|'''(?:[^']|'(?!''))*'{3,5}"
    r'|"(?:[^"\\\n]|\\.)*"'
    r"|'[^'\n]*'"
)
"""Any string, long ones first."""
_PLAIN: Final = re.compile(r"[^,\]}#\n]*")
"""A number, date, time or truth value."""


def lines_of(text: str) -> dict[FieldPath, int]:
    """Return the line, from 1, on which each table, field and list element of a document begins.

    Args:
        text: A document that ``tomllib`` accepts; of any other the result is what precedes its first error.
    """
    scanner = _Scanner(text)
    scanner.scan()
    return scanner.lines


class _Scanner:
    """Walks through a document once and notes where things begin."""

    def __init__(self, text: str) -> None:
        self.lines: dict[FieldPath, int] = {}
        self._text, self._at = text, 0
        self._counted, self._line = 0, 1
        self._lengths: dict[FieldPath, int] = {}
        """Number of tables seen of each array of tables."""

    def scan(self) -> None:
        """Scan the document."""
        table: FieldPath = ()
        while self._skip() < len(self._text):
            begin = self._at
            if self._takes("[["):
                table = self._table(self._key(), many=True)
                self._takes("]]")
            elif self._takes("["):
                table = self._table(self._key(), many=False)
                self._takes("]")
            else:
                self._pair(table)
            if self._at == begin:
                return  # no TOML

    def _table(self, key: Sequence[str], *, many: bool) -> FieldPath:
        path: FieldPath = ()
        for i, part in enumerate(key):
            path = (*path, part)
            self._note(path)
            length = self._lengths.get(path, 0)
            if many and i == len(key) - 1:
                self._lengths[path] = length + 1
                path = (*path, length)
                self._note(path)
            elif length:
                path = (*path, length - 1)
        return path

    def _pair(self, table: FieldPath) -> None:
        path = table
        for part in self._key():
            path = (*path, part)
            self._note(path)
        self._skip()
        self._takes("=")
        self._skip()
        self._value(path)

    def _value(self, path: FieldPath) -> None:
        if string := _STRING.match(self._text, self._at):
            self._at = string.end()
        elif self._takes("["):
            index = 0
            while not self._ends("]"):
                self._note((*path, index))
                self._value((*path, index))
                index += 1
                self._skip()
                self._takes(",")
        elif self._takes("{"):
            while not self._ends("}"):
                self._pair(path)
                self._skip()
                self._takes(",")
        else:
            plain = _PLAIN.match(self._text, self._at)
            assert plain is not None
            self._at = plain.end()

    def _ends(self, bracket: str) -> bool:
        """Return whether a list or an inline table ends here, or the document does."""
        begin = self._skip()
        return self._takes(bracket) or begin >= len(self._text) or self._text[begin] in "]}"

    def _key(self) -> list[str]:
        parts: list[str] = []
        while True:
            self._skip()
            part = _PART.match(self._text, self._at)
            if part is None:
                return parts
            self._at = part.end()
            parts.append(_unquoted(part[0]))
            self._skip()
            if not self._takes("."):
                return parts

    def _takes(self, text: str) -> bool:
        found = self._text.startswith(text, self._at)
        self._at += len(text) if found else 0
        return found

    def _skip(self) -> int:
        blank = _BLANK.match(self._text, self._at)
        assert blank is not None
        self._at = blank.end()
        return self._at

    def _note(self, path: FieldPath) -> None:
        """Note the present line for what begins here, unless it has begun before."""
        self._line += self._text.count("\n", self._counted, self._at)
        self._counted = self._at
        self.lines.setdefault(path, self._line)


def _unquoted(part: str) -> str:
    if part[0] not in "\"'":
        return part
    try:
        return str(tomllib.loads(f"k = {part}")["k"])
    except tomllib.TOMLDecodeError:
        return part
