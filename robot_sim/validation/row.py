"""One line of the validation: what should come out, how near, and what does."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Row:
    """A quantity with its target and how far it may be from it."""

    group: str
    """Under which heading it stands."""
    name: str
    target: float
    tolerance: float
    """Largest distance from the target, in the same unit, >= 0; infinite if nothing judges it."""
    value: float
    """What the simulation gave."""
    unit: str
    """Empty for a ratio or a count."""
    source: str
    """Where the target comes from."""
    digits: int = 3
    """Decimals with which to print."""
    relative: bool = False
    """Whether to print the tolerance as a share of the target."""
    control: bool = False
    """Whether the value must not be near: a rig that cannot fail proves nothing."""

    @property
    def passed(self) -> bool:
        """Whether the value is near enough (a control's: not near); NaN never passes."""
        if math.isnan(self.value):
            return False
        return (abs(self.value - self.target) <= self.tolerance) is not self.control

    @property
    def result(self) -> str:
        """One word."""
        if math.isinf(self.tolerance):
            return "told"
        if self.control:
            return "fails, as it must" if self.passed else "passes, and must not"
        return "ok" if self.passed else "missed"

    @property
    def cells(self) -> tuple[str, str, str, str, str, str]:
        """Name, target, tolerance, value, result and source as text."""
        unit = f" {self.unit}" if self.unit else ""
        if math.isinf(self.tolerance):
            tolerance = "none"
        elif self.relative:
            tolerance = f"± {100.0 * self.tolerance / abs(self.target):.3g} %"
        elif self.tolerance == 0.0:
            tolerance = "exact"
        else:
            tolerance = f"± {self.tolerance:.3g}{unit}"
        return (
            self.name,
            f"{self._text(self.target)}{unit}",
            tolerance,
            f"{self._text(self.value)}{unit}",
            self.result,
            self.source,
        )

    def __str__(self) -> str:
        name, target, tolerance, value, result, source = self.cells
        return f"{name}: {value}, target {target} {tolerance}, {result} ({source})"

    def _text(self, number: float) -> str:
        text = f"{number:.{self.digits}f}"
        # Rounding leaves a sign on nothing.
        return text.removeprefix("-") if float(text) == 0.0 else text


def within(
    group: str,
    name: str,
    target: float,
    share: float,
    value: float,
    *,
    unit: str = "",
    source: str,
    digits: int = 3,
) -> Row:
    """Return a row whose value must be within ``share`` of the target."""
    tolerance = share * abs(target)
    return Row(group, name, target, tolerance, value, unit, source, digits, relative=True)


def reported(
    group: str, name: str, target: float, value: float, unit: str, source: str, digits: int
) -> Row:
    """Return a row that nothing judges: a value beside one that it need not meet."""
    return Row(group, name, target, math.inf, value, unit, source, digits)
