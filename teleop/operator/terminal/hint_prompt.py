"""Asking for a hint on the keyboard: the number of a place, or x, y and heading."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from localization.types import Pose
from teleop.operator.named_places import pose_of

_LONGEST: Final = 60
"""Number of characters that can be typed."""


@dataclass(frozen=True, slots=True)
class HintPrompt:
    """What was typed so far; a value."""

    places: Mapping[str, Pose]
    """Places to choose from; without any, x, y and heading are asked for."""
    text: str = ""
    """The characters that were typed."""
    problem: str = ""
    """Why the last input could not be taken; empty if there was none."""
    answer: Pose | None = None
    """The pose that was chosen; None before."""
    done: bool = False
    """Whether it is over, with or without an answer."""

    @property
    def lines(self) -> tuple[str, ...]:
        """What is shown."""
        if not self.places:
            ask = "hint: x [m], y [m], heading [deg], for example 23.5 3.4 -170"
            return (f"{ask}   (enter sends, esc cancels)", f"> {self.text}_  {self.problem}")
        names = [f"{i} {name}" for i, name in enumerate(sorted(self.places), start=1)]
        wide = max(len(name) for name in names) + 2
        row = max(1, 78 // wide)
        menu = [
            "".join(n.ljust(wide) for n in names[i : i + row]) for i in range(0, len(names), row)
        ]
        return (
            "hint at a place: its number, then enter   (esc cancels)",
            *menu,
            f"> {self.text}_  {self.problem}",
        )

    def after(self, key: str) -> HintPrompt:
        """Return the prompt after a key, by its name."""
        if key == "escape" or (key == "backspace" and not self.text):
            return replace(self, done=True)
        if key == "backspace":
            return replace(self, text=self.text[:-1], problem="")
        if key == "enter":
            return self._entered()
        if key in "0123456789.,-+ " and len(self.text) < _LONGEST:
            return replace(self, text=self.text + key, problem="")
        return self

    def _entered(self) -> HintPrompt:
        words = self.text.replace(",", " ").split()
        try:
            if self.places:
                (word,) = words
                names = sorted(self.places)
                index = int(word)
                if not 1 <= index <= len(names):
                    raise ValueError
                return replace(self, answer=self.places[names[index - 1]], done=True)
            values = [float(word) for word in words]
            if len(values) != 3 or not np.isfinite(values).all():
                raise ValueError
            return replace(self, answer=pose_of(values), done=True)
        except ValueError:
            want = f"a number from 1 to {len(self.places)}" if self.places else "three numbers"
            return replace(self, text="", problem=f"{want}, please")
