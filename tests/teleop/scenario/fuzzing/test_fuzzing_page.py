"""The sheet of the fuzzer's rules lists those that there are."""

from __future__ import annotations

import re
from pathlib import Path

from teleop.scenario.referee.rules.rule_book import RULES

PAGE = Path(__file__).parents[4] / "docs" / "sheets" / "rules.md"


def test_sheet_lists_every_rule_with_its_sentence() -> None:
    rows = re.findall(r"^\| `(.+?)` \| (.+?) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert rows == [(rule.name, rule.sentence) for rule in RULES]
