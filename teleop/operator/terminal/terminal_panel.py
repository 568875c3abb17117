"""The operator's panel in a terminal: state, events and help that stay where they are."""

from __future__ import annotations

import os
import textwrap
from contextlib import suppress
from typing import Final

from teleop.operator.controls.gamepad import LAYOUT
from teleop.operator.controls.keyboard import Keyboard
from teleop.operator.operating_data import gears, station_keys
from teleop.operator.robot_state.alarm_rules import Severity
from teleop.operator.robot_state.station_view import StationView
from teleop.operator.terminal.hint_prompt import HintPrompt
from teleop.operator.terminal.terminal import Terminal

_MARKS: Final = {
    Severity.CALM: "   ",
    Severity.INFO: " i ",
    Severity.STALE: " . ",
    Severity.WARNING: " ! ",
    Severity.ALARM: "!!!",
}
_STYLES: Final = {
    Severity.CALM: "32",
    Severity.INFO: "36",
    Severity.STALE: "90",
    Severity.WARNING: "33",
    Severity.ALARM: "1;37;41",
}
"""Text styles of ANSI terminals (ECMA-48); the marks say the same without colour."""


def panel_lines(
    view: StationView,
    keyboard: Keyboard,
    now: int,
    *,
    title: str,
    pads: tuple[str, ...] = (),
    prompt: HintPrompt | None = None,
    help_shown: bool = True,
    size: tuple[int, int] = (80, 24),
) -> list[tuple[Severity | None, str]]:
    """Return the lines of the panel with their severity, as many and as wide as fit.

    Args:
        view: What is known of robot and link.
        keyboard: Gear and what the terminal does not report.
        now: Time of the station [ns].
        title: First line.
        pads: Names of gamepads.
        prompt: A question that is open.
        help_shown: Whether the keys are listed.
        size: Columns and rows.
    """
    width, height = size
    lines: list[tuple[Severity | None, str]] = [(None, title)]
    for notice in (view.link(now), *view.notices(now)):
        marked = f"{_MARKS[notice.severity]} {notice.text}"
        lines += [(notice.severity, line) for line in _wrapped(marked, width)]
    lines.append((None, "    " + "   ".join(view.figures(now))))
    gear = gears()[keyboard.gear]
    speeds = f"gear {gear.name}: {gear.speed:g} m/s, {gear.turn:g} rad/s"
    for text in (f"{speeds}   drive: {_drive(view, now)}", view.map):
        lines += [(None, line) for line in _wrapped(f"    {text}", width) if text]
    if pads:
        lines += [(None, line) for line in _wrapped(f"    {_pad_words(pads)}", width)]
    if keyboard.unknown:
        lines += [(Severity.STALE, line) for line in _wrapped(f"    {keyboard.unknown}", width)]
    if prompt is not None:
        lines += [(Severity.WARNING, f"    {line}") for line in prompt.lines]
    elif help_shown:
        lines += [(None, "")] + [(None, f"    {line}") for line in _help(width - 4)]
    lines.append((None, ""))
    room = max(0, height - len(lines))
    events = [line for event in view.events.last(room) for line in _wrapped(str(event), width)]
    lines += [(None, line) for line in events[len(events) - min(room, len(events)) :]]
    return [(severity, line[:width]) for severity, line in lines[:height]]


def _help(width: int) -> list[str]:
    """Return what the keys do, as many on a line as fit: what happens needs the lines below."""
    lines = [""]
    for key in station_keys():
        entry = f"{key['keys']}: {key['does']}"
        joined = f"{lines[-1]}   {entry}" if lines[-1] else entry
        if len(joined) <= width:
            lines[-1] = joined
        else:
            lines.append(entry)
    return lines


def _pad_words(pads: tuple[str, ...]) -> str:
    """Return the names of gamepads, and what their buttons do."""
    uses = (f"{use['name']} {use['does']}" for use in LAYOUT["buttons"].values())
    return f"gamepad {', '.join(pads)}: left stick; {'; '.join(uses)}"


def _wrapped(text: str, width: int) -> list[str]:
    """Return a text in lines that fit, the following ones indented."""
    indent = " " * (len(text) - len(text.lstrip()) + 4)
    return textwrap.wrap(text, max(20, width), subsequent_indent=indent)


def _drive(view: StationView, now: int) -> str:
    """Return who drives, or why nobody does."""
    if not view.control or view.ages.stale("/teleop/state", now):
        return "unknown"
    who = {"idle": "free", "estop": "stopped"}.get(view.control, view.controller)
    return f"{who} ({view.control_reason})"


class Panel:
    """Owns the screen of a terminal; draws what changed."""

    def __init__(self, terminal: Terminal, *, encoding: str) -> None:
        """Go to the alternate screen; what was there comes back at ``close``."""
        self._terminal, self._encoding = terminal, encoding
        self._drawn: list[tuple[Severity | None, str]] = []
        self._size = self.size
        terminal.enter_screen()

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows."""
        with suppress(OSError):
            columns, rows = os.get_terminal_size(self._terminal.out)
            if columns > 0 and rows > 0:
                return columns, rows
        return 80, 24

    def show(self, lines: list[tuple[Severity | None, str]]) -> None:
        """Draw the lines that differ from those on the screen."""
        size = self.size
        if size != self._size:
            self._size, self._drawn = size, []
            self._terminal.write(b"\x1b[2J")
        data = b""
        for i in range(max(len(lines), len(self._drawn))):
            line = lines[i] if i < len(lines) else (None, "")
            if i < len(self._drawn) and self._drawn[i] == line:
                continue
            severity, text = line
            printable = "".join(c if c.isprintable() else " " for c in text)
            style = "" if severity is None else f"\x1b[{_STYLES[severity]}m"
            row = f"\x1b[{i + 1};1H{style}{printable}\x1b[0m\x1b[K"
            data += row.encode(self._encoding, errors="replace")
        if data:
            self._terminal.write(data)
        self._drawn = list(lines)

    def close(self) -> None:
        """Bring back the screen that was there before."""
        self._terminal.leave_screen()
