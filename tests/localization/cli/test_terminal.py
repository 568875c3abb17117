"""Lines in 80 columns, results as JSON, and the progress line with the time that is left."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from localization.cli.terminal import WIDTH, Progress, duration, fitted, say_json


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


def test_long_lines_are_continued_below_their_last_column() -> None:
    text = " ".join(["word"] * 30)
    lines = fitted(f"  health   {text}", text, "  short")
    assert max(map(len, lines)) <= WIDTH
    assert lines[0].startswith("  health   word")
    assert lines[1].startswith(" " * 11 + "word")
    assert lines[-1] == "  short"
    assert " ".join(" ".join(lines).split()) == f"health {text} {text} short"


def test_lines_within_a_text_stay_lines() -> None:
    text = "places  hall\n" + "        kitchen\n" * 20 + "        library"
    assert "\n".join(fitted(text)) == text


def test_path_without_blanks_stays_whole() -> None:
    path = "/".join(["folder"] * 20)
    assert any(path in line for line in fitted(f"files in {path}"))


def test_json_holds_numbers_of_all_kinds(capsys: pytest.CaptureFixture[str]) -> None:
    @dataclass(frozen=True)
    class Figures:
        error: float
        stamps: object

    say_json(
        {"a": Figures(float("inf"), np.arange(2)), "b": np.float64(0.5), "c": Path("x"), 1: ()}
    )
    assert json.loads(capsys.readouterr().out) == {
        "a": {"error": None, "stamps": [0, 1]}, "b": 0.5, "c": "x", "1": [],
    }  # fmt: skip


@pytest.mark.process
def test_command_goes_on_when_nobody_reads_what_it_prints(tmp_path: Path) -> None:
    """Its result is in files: they must be written to the end."""
    code = (
        "from pathlib import Path\n"
        "from localization.cli.terminal import Progress, say\n"
        "for i in range(3000):\n"
        "    say('line ' * 20)\n"
        "    Progress()(0.5, 'half')\n"
        f"Path({str(tmp_path / 'done')!r}).write_text('all')\n"
    )
    reader, writer = os.pipe()
    process = subprocess.Popen([sys.executable, "-c", code], stdout=writer, stderr=writer)
    os.close(writer)
    os.close(reader)
    assert process.wait(60) == 0
    assert (tmp_path / "done").read_text() == "all"
