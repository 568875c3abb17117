from __future__ import annotations

import re
from pathlib import Path

import pytest

from localization.cli.settings_table import Setting, markdown, settings_of, tables, written

ROOT = Path(__file__).resolve().parents[3]
COUNTS = re.compile(
    r"share|fraction|times|many|explain|less of it|points|kernels|sigma|information"
)
"""Words of what has no unit: a share of something, or how many of something."""

EVERY = [
    pytest.param(config, setting, id=f"{config.__name__}.{setting.name}")
    for _, config in tables()
    for setting in settings_of(config)
]


def test_page_of_settings_is_made_from_the_dataclasses() -> None:
    page = (ROOT / "docs" / "settings.md").read_text(encoding="utf-8")
    assert page == markdown(), "run: python -m localization.cli.settings_table > docs/settings.md"


@pytest.mark.parametrize(("config", "setting"), EVERY)
def test_every_setting_says_what_it_is(config: type, setting: Setting) -> None:
    assert setting.text, f"{config.__name__}.{setting.name} has no docstring"


@pytest.mark.parametrize(("config", "setting"), EVERY)
def test_every_number_names_its_unit_or_what_it_counts(config: type, setting: Setting) -> None:
    # Whole numbers count something, unless their unit is named.
    if not isinstance(setting.default, float | tuple):
        return
    unit = "[" in setting.text or "chi-square" in setting.text
    assert unit or COUNTS.search(setting.text), f"{config.__name__}.{setting.name}: {setting.text}"


def test_defaults_are_written_as_people_read_them() -> None:
    assert written(0.5, "[m]") == "0.5"
    assert written(0.017453292519943295, "one sigma [rad]") == "0.0175 (1 deg)"
    assert written(500_000_000, "[ns]") == "0.5 s"
    assert written((0.1, 2), "") == "0.1, 2"
    assert (written(True, ""), written(None, "")) == ("yes", "none")
