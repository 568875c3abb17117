from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, make_dataclass
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from localization.cli.settings_table import Setting, markdown, settings_of, tables, written
from localization.config import LocalizerConfig

ROOT = Path(__file__).resolve().parents[3]
DIMENSIONLESS = re.compile(
    r"\b(shares?|fractions?|ratio|times|many|numbers?|counts?|explain\w*|points|kernels|sigmas?|information)\b",
    re.IGNORECASE,
)
"""Words of settings without a unit: a share of something, or a number of things."""


def defects(config: type) -> Iterator[str]:
    """Yield the settings of a tree of dataclasses that lack a docstring, or a unit for their numbers."""
    for path, table in tables(config):
        for setting in settings_of(table):
            name = f"{path}.{setting.name}".lstrip(".")
            if not setting.text:
                yield f"{name} has no docstring"
            elif not has_unit(setting):
                yield f"{name} has no unit: {setting.text}"


def has_unit(setting: Setting) -> bool:
    # Integers are counts unless they name a unit.
    if not isinstance(setting.default, float | tuple):
        return True
    unit = "[" in setting.text or "chi-square" in setting.text
    return unit or DIMENSIONLESS.search(setting.text) is not None


def test_page_of_settings_is_made_from_the_dataclasses() -> None:
    page = (ROOT / "docs" / "settings.md").read_text(encoding="utf-8")
    assert page == markdown(), "run: python -m localization.cli.settings_table > docs/settings.md"


def test_every_setting_has_a_docstring_with_its_unit() -> None:
    assert list(defects(LocalizerConfig)) == []


@dataclass
class Inner:
    """Settings with defects."""

    silent: int = 3
    length: float = 0.5
    """How far it reaches."""
    good: float = 0.5
    """Length [m]."""


@dataclass
class Outer:
    """Settings that hold others."""

    pair: tuple[float, float] = (0.1, 0.2)
    """Width and height."""
    late: int = 1_000
    """Number of readings."""
    angle: float = 1.0
    inner: Inner = field(default_factory=Inner)


def test_planted_defects_are_found() -> None:
    assert list(defects(Outer)) == [
        "pair has no unit: Width and height.",
        "angle has no docstring",
        "inner.silent has no docstring",
        "inner.length has no unit: How far it reaches.",
    ]


def test_setting_without_a_default_is_rejected() -> None:
    with pytest.raises(TypeError, match="bare has no default"):
        settings_of(make_dataclass("Bare", [("bare", int)]))


def test_page_lists_every_setting_of_every_table() -> None:
    page = markdown()
    for path, config in tables():
        title = f"LocalizerConfig.{path}" if path else "LocalizerConfig"
        section = page.partition(f"## `{title}`")[2].partition("\n## ")[0]
        listed = re.findall(r"^\| `(\w+)` \|", section, flags=re.MULTILINE)
        assert listed == [setting.name for setting in settings_of(config)]


def test_defaults_are_written_for_people() -> None:
    assert written(0.5, "[m]") == "0.5"
    assert written(0.017453292519943295, "one sigma [rad]") == "0.0175 (1 deg)"
    assert written(500_000_000, "[ns]") == "0.5 s"
    assert written((0.1, 2), "") == "0.1, 2"
    assert (written(True, ""), written(None, "")) == ("yes", "none")


@given(st.integers(1, 10**6))
def test_nanoseconds_are_written_in_seconds(milliseconds: int) -> None:
    text = written(milliseconds * 1_000_000, "Time [ns].")
    assert text.endswith(" s")
    assert float(text.removesuffix(" s")) == pytest.approx(milliseconds * 1e-3, rel=1e-5)
