"""Progress of long work: the time left is shown where it is known."""

from __future__ import annotations

import pytest

from localization.cli.terminal import Progress, time_left


def test_time_left_is_that_of_the_same_pace() -> None:
    assert time_left(0.25, 20.0) == ", about 60 s left"
    assert time_left(0.1, 60.0) == ", about 9 min left"


@pytest.mark.parametrize(("share", "elapsed"), [(0.01, 60.0), (0.5, 1.0), (1.0, 60.0), (0.0, 60.0)])
def test_time_left_is_not_guessed(share: float, elapsed: float) -> None:
    assert time_left(share, elapsed) == ""


def test_progress_of_long_work_shows_the_time_left(capsys: pytest.CaptureFixture[str]) -> None:
    bar = Progress()
    bar(0.05, "begun")
    bar._begun -= 30.0
    bar(0.6, "closing loops")
    lines = capsys.readouterr().err.splitlines()
    assert "left" not in lines[0]
    assert lines[1].startswith(" 60%  closing loops, about 20 s left")
