from __future__ import annotations

import pytest

from teleop.bridges import seldom
from tests.teleop.support import in_a_loop


@in_a_loop
async def test_lines_come_now_and_then_with_the_number_kept_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    said: list[str] = []
    lines = seldom.Seldom()
    for text in "abc":
        lines.say(said.append, text)
    monkeypatch.setattr(seldom, "PERIOD", 0.0)
    for text in "de":
        lines.say(said.append, text)
    assert said == ["a", "d; 2 such lines were kept back", "e"]
