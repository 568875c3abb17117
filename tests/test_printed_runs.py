"""What README and tutorial print of a run is what the command prints: FARSTEER_RENEW=1 writes it into the pages."""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

ROOT: Final = Path(__file__).parents[1]
GAP: Final = "  ..."
NUMBER: Final = re.compile(r"\d+(?:\.\d+)?")
COLUMN: Final = re.compile(
    rf" *{NUMBER.pattern}"
)  # a number of more digits has fewer spaces before it
SCATTER: Final = 0.03
"""By how much another kind of processor may change a figure; its last printed digit may differ in any case."""


def printed(folder: Path, cache: Path, *words: str) -> str:
    environment = {
        **os.environ,
        "PYTHONPATH": str(ROOT),
        "XDG_CACHE_HOME": str(cache.parent),
        "COLUMNS": "80",
    }
    done = subprocess.run(
        [sys.executable, "-m", "teleop", *words],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def shown(page: str, begins: str) -> str:
    """The block of a page that begins with a text."""
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks: list[str] = re.findall(r"^```text\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    return next(block for block in blocks if block.startswith(begins))


def label(line: str) -> str:
    """The words that a line begins with, such as ``position max`` after ``met``."""
    return NUMBER.sub("#", " ".join(re.split(r" {2,}", line.strip())[:2])).partition("#")[0]


def excerpt(output: str, like: str) -> str:
    """The parts of an output that another text shows of an older one, from the same first to the same last line."""
    lines, parts, begin = [line.rstrip() for line in output.splitlines()], [], 0
    for part in like.split(f"{GAP}\n"):
        first, *rest = part.rstrip("\n").split("\n")
        begin = next(i for i in range(begin, len(lines)) if label(lines[i]) == label(first))
        end = begin
        if rest:
            end = next(i for i in range(begin, len(lines)) if label(lines[i]) == label(rest[-1]))
        parts.append("\n".join(lines[begin : end + 1]) + "\n")
        begin = end + 1
    return f"{GAP}\n".join(parts)


def alike(ours: str, theirs: str) -> bool:
    """Whether two figures as they are printed differ by no more than the scatter or the last digit."""
    digits = len(ours.partition(".")[2])
    return math.isclose(float(ours), float(theirs), rel_tol=SCATTER, abs_tol=1.5 * 10.0**-digits)


def check(page: str, output: str, begins: str) -> None:
    """Compare the block of a page with what a command printed, or renew it."""
    there = shown(page, begins)
    now = excerpt(output, there)
    if os.environ.get("FARSTEER_RENEW"):
        text = (ROOT / page).read_text(encoding="utf-8")
        (ROOT / page).write_text(text.replace(there, now), encoding="utf-8")
        return
    assert COLUMN.sub(" #", there) == COLUMN.sub(" #", now)
    pairs = zip(NUMBER.findall(there), NUMBER.findall(now), strict=True)
    assert [pair for pair in pairs if not alike(*pair)] == [], now


@pytest.mark.long
@pytest.mark.process
@pytest.mark.slow
def test_readme_and_tutorial_show_what_their_commands_print(tmp_path: Path, cache: Path) -> None:
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    output = printed(tmp_path, cache, "sim", "--out", "runs/first")
    check("README.md", output, "office, seed 0")
    text = (ROOT / "docs/tutorial.md").read_text(encoding="utf-8")
    command = re.search(r"^\.venv/bin/farsteer (localize .* runs/look)$", text, re.MULTILINE)
    assert command is not None
    check("docs/tutorial.md", printed(tmp_path, cache, *command[1].split()), "  duration")


@pytest.mark.parametrize(
    ("ours", "theirs", "same"),
    [("4.0", "4.1", True), ("11.3", "11.2", True), ("0.070", "0.082", False), ("99", "96", False)],
)
def test_figures_are_alike_within_the_last_digit_or_three_per_cent(
    ours: str, theirs: str, same: bool
) -> None:
    assert alike(ours, theirs) is same


def test_state_that_a_page_does_not_show_is_seen() -> None:
    there = "  health  tracking 99.2%\n  sweeps  12\n"
    now = "  mode    open\n  health  tracking 96.5%, degraded 2.7%\n  sweeps  12\n"
    assert excerpt(now, there) == "  health  tracking 96.5%, degraded 2.7%\n  sweeps  12\n"
