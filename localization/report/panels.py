"""Panels of a page's figures: curves or states over an axis, with ticks and a legend; ``figures.html`` draws them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from markupsafe import Markup

from localization.geometry import FloatArray
from localization.report.scales import Linear, Scale

Ticks = Sequence[tuple[float, str]]
"""Places on an axis in per cent of its length, with their texts."""

Keys = Sequence[tuple[str, str]]
"""Legend: classes of a style, and what is drawn so."""

_WIDE_ENOUGH = 9.0
"""Share of the time axis from which a state is named within its band [%]; the legend names all."""
_STATES = {"waiting", "tracking", "degraded", "slipping", "suspect", "lost", "relocalising"}
_STATES |= {"idle", "armed", "disarmed", "estop"}


@dataclass(frozen=True, slots=True)
class Band:
    """The time for which a state lasts."""

    state: str
    """The state."""
    begin: float
    """Begin on the time axis [%]."""
    width: float
    """Length on the time axis [%]."""

    @property
    def style(self) -> str:
        """Class of its colour."""
        return state_style(self.state)

    @property
    def name(self) -> str:
        """The state, if there is room for it."""
        return self.state if self.width > _WIDE_ENOUGH else ""


@dataclass(frozen=True, slots=True)
class Panel:
    """One panel."""

    name: str
    """What it shows, with its unit."""
    style: str = ""
    """Classes for its style: ``tall``, ``strip`` or ``axis``."""
    drawn: Sequence[Markup] = ()
    """What is drawn, from the bottom to the top."""
    ticks: Ticks = ()
    """Ticks from the bottom to the top."""
    keys: Keys = ()
    """Legend."""
    bands: Sequence[Band] = ()
    """States."""
    across: Ticks = ()
    """Ticks of an axis below it, from left to right."""


def panel(
    name: str,
    scale: Scale,
    drawn: Sequence[Markup],
    *keys: tuple[str, str],
    style: str = "",
    across: Ticks = (),
) -> Panel:
    """Return a panel with curves of figures on a scale, and their legend."""
    return Panel(name, style, drawn, ticks_of(scale), keys, across=across)


def states_panel(name: str, states: Sequence[str], time: FloatArray) -> Panel:
    """Return coloured bands, each from the first tick of a state to that of the next one."""
    bands = []
    index = 0
    for state, run in groupby(states):
        begin = float(time[index - 1]) if index else 0.0
        index += sum(1 for _ in run)
        bands.append(Band(state, 100 * begin, 100 * (float(time[index - 1]) - begin)))
    keys = [(state_style(state), state) for state in dict.fromkeys(states)]
    return Panel(name, "strip", keys=keys, bands=bands)


def time_axis(seconds: float) -> Panel:
    """Return the numbers of the time axis, from 0 to ``seconds``."""
    return Panel("time [s]", "none", across=ticks_of(Linear(0.0, max(seconds, 1e-9)), parts=8))


def ticks_of(scale: Scale, *, parts: int = 5, unit: float = 1.0) -> Ticks:
    """Return the ticks of an axis, whose texts are in a unit."""
    values = scale.ticks(parts)
    shares = 100.0 * scale.share(np.array(values))
    # Plus zero: no text is "-0".
    return [(float(s), f"{v / unit + 0.0:.6g}") for s, v in zip(shares, values, strict=True)]


def state_style(state: str) -> str:
    """Return the class of a state's colour."""
    return f"is-{state}" if state in _STATES else "is-other"
