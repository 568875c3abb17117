"""What operators see and press, as data that the console page reads too: ``assets/operating``, with its README."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

from teleop.joystick import LAYOUT
from teleop.package_data import assets

_NAMES: Final = {"Arrow": "", "Key": "", "Digit": "", "Numpad": "", "Space": " "}
"""What browsers call a key, and terminals do not."""


@dataclass(frozen=True, slots=True)
class Gear:
    """How much of what keys and sticks request goes out."""

    action: str
    """The action that engages it."""
    name: str
    """Its name."""
    speed: float
    """Forward speed at full deflection [m/s]."""
    turn: float
    """Turn rate at full deflection [rad/s]."""


@cache
def operating_data(name: str) -> Mapping[str, Any]:
    """Return a file of the data by its name, such as ``alarms``."""
    text = (assets() / "operating" / f"{name}.json").read_text(encoding="utf-8")
    data: Mapping[str, Any] = json.loads(text)
    return data


@cache
def gears() -> tuple[Gear, ...]:
    """Return the gears with the speeds of the default joystick layout, the slowest first."""
    layout = LAYOUT
    return tuple(
        Gear(
            gear["gear"],
            gear["name"],
            gear["forward"] * (layout.turbo_speed if gear["turbo"] else layout.speed),
            gear["turn"] * layout.turn,
        )
        for gear in operating_data("controls")["gears"]
    )


@cache
def key_actions() -> Mapping[str, str]:
    """Return the actions of the station by the names of keys, as terminals have them."""
    return {
        _in_terminal(code): action
        for key in station_keys()
        for code, action in key["codes"].items()
    }


def station_keys() -> list[Mapping[str, Any]]:
    """Return the lines of the list of keys."""
    return [key for key in operating_data("controls")["keys"] if key.get("only") != "page"]


def _in_terminal(code: str) -> str:
    for prefix, name in _NAMES.items():
        if code.startswith(prefix):
            return name + code.removeprefix(prefix).lower()
    return code
