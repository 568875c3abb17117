"""Bytes of a terminal as key events: plain characters, arrows, and the reports of the kitty keyboard protocol.

The protocol is described at sw.kovidgoyal.net/kitty/keyboard-protocol: a terminal that has it reports repeats and
releases as ``CSI code ; modifiers : event u``, and arrows as ``CSI 1 ; modifiers : event A``. One that has it not
sends characters and ``CSI A`` alone, again and again while a key is held.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum
from typing import Final, TypeAlias


class KeyEvent(Enum):
    """What happened to a key."""

    PRESS = 1
    """Pressed; from a terminal without reports of releases also repeated."""
    REPEAT = 2
    """Still held."""
    RELEASE = 3
    """Released."""


@dataclass(frozen=True, slots=True)
class Key:
    """An event of a key."""

    name: str
    """A character in lower case, or up, down, left, right, enter, backspace, escape, ctrl-c."""
    event: KeyEvent = KeyEvent.PRESS
    """What happened to it."""


class TerminalReport(Enum):
    """What a terminal says of itself."""

    KITTY = "kitty keyboard protocol"
    """It has the protocol (the answer to ``CSI ? u``)."""
    ATTRIBUTES = "device attributes"
    """It is there (the answer to ``CSI c``, which every terminal gives)."""
    ALIVE = "status"
    """It is still there (the answer to ``CSI 5 n``)."""
    FOCUS_LOST = "focus lost"
    """Its window lost the keyboard."""
    FOCUS_GAINED = "focus gained"
    """Its window has the keyboard again."""


Input: TypeAlias = Key | TerminalReport

_SEQUENCE: Final = re.compile(r"\x1b\[([?<>=]?)([0-9;:]*)([ -/]*)([@-~])|\x1bO([A-DM])")
_PREFIX: Final = re.compile(r"\x1b(\[[?<>=]?[0-9;:]*[ -/]*|O)?\Z")
_ARROWS: Final = {"A": "up", "B": "down", "C": "right", "D": "left"}
_NAMED: Final = {
    10: "enter",
    13: "enter",
    27: "escape",
    127: "backspace",
    8: "backspace",
    57414: "enter",
}
"""Keys by code point; 57414 is the keypad's."""
_CONTROL: Final = 4
"""Bit of the modifier Ctrl."""
_LONGEST: Final = 64
"""Length of the longest sequence that is waited for [characters]."""


class KeyDecoder:
    """Decodes the bytes of one terminal; sequences may come in pieces."""

    def __init__(self) -> None:
        self._rest = ""

    def feed(self, data: bytes) -> list[Input]:
        """Return the events in bytes that were read, with what was incomplete before."""
        text = self._rest + data.decode("utf-8", errors="ignore")
        self._rest = ""
        found: list[Input] = []
        while text:
            if text[0] != "\x1b":
                found.append(Key(_name(ord(text[0]), text[0])))
                text = text[1:]
            elif match := _SEQUENCE.match(text):
                found += _decoded(match)
                text = text[match.end() :]
            elif _PREFIX.match(text) and len(text) < _LONGEST:
                self._rest, text = text, ""
            else:
                found.append(Key("escape"))
                text = text[1:]
        return found

    def idle(self) -> list[Input]:
        """Return the escape key if its byte came alone: no sequence pauses within."""
        alone, self._rest = self._rest == "\x1b", "" if self._rest == "\x1b" else self._rest
        return [Key("escape")] if alone else []


def _decoded(match: re.Match[str]) -> list[Input]:
    private, numbers, _, final, keypad = match.groups()
    if keypad is not None:
        return [Key(_ARROWS.get(keypad, "enter"))]
    if private == "?" and final in "uc":
        return [TerminalReport.KITTY if final == "u" else TerminalReport.ATTRIBUTES]
    if private:
        return []
    if final in "IO":
        return [TerminalReport.FOCUS_GAINED if final == "I" else TerminalReport.FOCUS_LOST]
    if final == "n" and numbers in ("0", "3"):
        return [TerminalReport.ALIVE]
    fields = [[int(n or 0) for n in field.split(":")] for field in numbers.split(";")]
    modifiers, event = 0, KeyEvent.PRESS
    if len(fields) > 1:
        modifiers = max(0, fields[1][0] - 1)
        if len(fields[1]) > 1 and fields[1][1] in (1, 2, 3):
            event = KeyEvent(fields[1][1])
    if final in _ARROWS:
        return [Key(_ARROWS[final], event)]
    code = fields[0][0]
    if final != "u" or not 0 < code < 0x110000:
        return []
    if modifiers & _CONTROL and code == ord("c"):
        return [Key("ctrl-c", event)]
    return [Key(_name(code, chr(code)), event)]


def _name(code: int, character: str) -> str:
    if code == 3:
        return "ctrl-c"
    return _NAMED.get(code, character.lower())
