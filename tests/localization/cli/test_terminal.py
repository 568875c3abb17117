"""The progress line: what is done, and how long the rest will take."""

from __future__ import annotations

import pytest

from localization.cli.terminal import Progress, duration


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.2, "1 s"), (41.0, "41 s"), (59.9, "60 s"), (170.0, "3 min"), (4790.0, "1 h 20 min")],
)
def test_durations_are_said_as_people_do(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_time_left_follows_from_the_share_that_was_done(capsys: pytest.CaptureFixture[str]) -> None:
    now = [100.0]
    bar = Progress(clock=lambda: now[0])
    for share, seconds in ((0.0, 0.0), (0.05, 1.0), (0.2, 10.0), (0.6, 30.0), (1.0, 50.0)):
        now[0] = 100.0 + seconds
        bar(share, "reading")
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        "  0%  reading",
        " 20%  reading, 40 s left",
        " 60%  reading, 20 s left",
        "100%  reading",
    ]


def test_work_that_was_done_before_the_first_line_does_not_shorten_the_rest(
    capsys: pytest.CaptureFixture[str],
) -> None:
    now = [0.0]
    bar = Progress(clock=lambda: now[0])
    bar(0.5, "reading")
    now[0] = 10.0
    bar(0.75, "reading")
    assert "75%  reading, 10 s left" in capsys.readouterr().err
