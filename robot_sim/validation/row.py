"""One row of the validation: a quantity with its target, tolerance, measured value and source."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass


@dataclass(frozen=True, slots=True)
class Row:
    """A quantity, its target and the largest deviation allowed."""

    group: str
    """Heading under which the row is printed."""
    name: str
    """What is measured, in words."""
    target: float
    """The value that theory or a publication gives, in ``unit``."""
    tolerance: float
    """Largest deviation from the target, in ``unit``, >= 0; infinite for a row that is only reported."""
    value: float
    """The value that the simulation gives, in ``unit``."""
    _: KW_ONLY
    unit: str = ""
    """The unit; empty for a ratio or a count."""
    source: str
    """Where the target comes from."""
    digits: int = 3
    """Number of decimals that are printed."""
    relative: bool = False
    """Whether the tolerance is printed as a share of the target."""
    control: bool = False
    """Whether the value must lie outside the tolerance: a test rig that cannot fail proves nothing."""
    fitted: bool = False
    """Whether a parameter of the simulation was fitted to this target, so that meeting it proves little."""

    @property
    def judged(self) -> bool:
        """Whether the row has a tolerance that it can miss."""
        return math.isfinite(self.tolerance)

    @property
    def passed(self) -> bool:
        """Whether the value is within the tolerance (a control's: outside of it); NaN never passes."""
        if math.isnan(self.value):
            return False
        return (abs(self.value - self.target) <= self.tolerance) is not self.control

    @property
    def result(self) -> str:
        """The result as it is printed."""
        if not self.judged:
            return "reported"
        if self.control:
            return "fails, as it must" if self.passed else "passes, and must not"
        if not self.passed:
            return "missed"
        return "ok (fitted)" if self.fitted else "ok"

    @property
    def cells(self) -> tuple[str, str, str, str, str, str]:
        """Name, target, tolerance, value, result and source as text."""
        unit = f" {self.unit}" if self.unit else ""
        if not self.judged:
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
        # Rounding may leave a minus sign before zero.
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
    fitted: bool = False,
) -> Row:
    """Return a row whose value must be within ``share`` of the target."""
    return Row(
        group,
        name,
        target,
        share * abs(target),
        value,
        unit=unit,
        source=source,
        digits=digits,
        relative=True,
        fitted=fitted,
    )


def reported(
    group: str,
    name: str,
    target: float,
    value: float,
    *,
    unit: str = "",
    source: str,
    digits: int = 3,
) -> Row:
    """Return a row without a tolerance: a value is printed beside one that it need not meet."""
    return Row(group, name, target, math.inf, value, unit=unit, source=source, digits=digits)
