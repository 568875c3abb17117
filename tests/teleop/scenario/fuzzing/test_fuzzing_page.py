"""The page on fuzzing lists the rules that there are."""

from __future__ import annotations

import re
from pathlib import Path

from teleop.scenario.referee.rules.rule_book import RULES

PAGE = Path(__file__).parents[4] / "docs" / "fuzzing.md"


def test_page_lists_every_rule_with_its_sentence() -> None:
    rows = re.findall(r"^\| `(.+?)` \| (.+?) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert rows == [(rule.name, rule.sentence) for rule in RULES]
