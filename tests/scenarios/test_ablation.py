"""The ablation's own parts: its switches change the settings, and its table shows what changed."""

from __future__ import annotations

import pytest

from benchmarks.ablation.mechanisms import ALL, MECHANISMS, both
from benchmarks.ablation.runs import PAIRS, SPECIAL, concerned
from localization.pipeline.localizer import LocalizerConfig


@pytest.mark.parametrize("name", MECHANISMS)
def test_each_mechanism_is_taken_out_by_settings_that_are_not_the_default(name: str) -> None:
    whole = LocalizerConfig()
    change = MECHANISMS[name]
    assert change(whole) != whole
    assert change(change(whole)) == change(whole)
    assert both()(whole) == whole


def test_drives_made_for_some_mechanisms_are_run_without_those_only() -> None:
    assert {name for names in SPECIAL.values() for name in names} <= set(MECHANISMS)
    assert {name for pair in PAIRS for name in pair} <= set(MECHANISMS)
    assert concerned("office", "debiasing")
    assert concerned("late scans, office", ALL)
    assert concerned("late scans, office", "debiasing + late readings")
    assert not concerned("late scans, office", "debiasing")
