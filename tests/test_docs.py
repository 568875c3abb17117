"""The documentation is true: its code runs, its commands parse, its links and numbers hold."""

from __future__ import annotations

import math
import os
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import tyro
from mcap.reader import make_reader

from localization import Health, LocalizerConfig, Pose, Verdict
from robot_sim import IMU_MOUNT, MOUNTS
from teleop.__main__ import Command

ROOT = Path(__file__).parents[1]
PAGES = [
    page.relative_to(ROOT).as_posix()
    for pattern in ("README.md", "CHANGELOG.md", "docs/*.md", "scenes/*/README.md")
    for page in sorted(ROOT.glob(pattern))
]


@dataclass(frozen=True)
class Block:
    """A fenced block of a page."""

    page: str
    language: str
    text: str
    line: int

    def __str__(self) -> str:
        return f"{self.page}:{self.line}"


def text_of(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def blocks(language: str) -> list[Block]:
    """All fenced blocks in a language."""
    found = []
    for page in PAGES:
        text = text_of(page)
        for match in re.finditer(r"^```(\w*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
            line = text.count("\n", 0, match.start()) + 1
            found.append(Block(page, match[1], match[2], line))
    return [block for block in found if block.language == language]


def prose(page: str) -> str:
    """A page without its fenced blocks."""
    return re.sub(r"^```.*?^```$", "", text_of(page), flags=re.MULTILINE | re.DOTALL)


def spans(page: str) -> list[str]:
    """What stands in backticks in a page, outside of blocks, each on one line."""
    return [" ".join(span.split()) for span in re.findall(r"`([^`]+)`", prose(page))]


def rows(page: str, heading: str) -> list[list[str]]:
    """The cells of the table that follows a line beginning with ``heading``, without its head."""
    lines = text_of(page).splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith(heading))
    table = []
    for line in lines[start + 2 :]:
        if not line.startswith("|"):
            break
        table.append([cell.strip() for cell in line.strip("|").split("|")])
    return table


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder like a clone after ``make sim ARGS="--out runs/first"``, but for a short drive."""
    folder = tmp_path_factory.mktemp("clone")
    (folder / "scenes").symlink_to(ROOT / "scenes")
    words = ("sim", "--duration", "5", "--out", "runs/first")
    done = in_clone(folder, "-m", "teleop", *words)
    assert done.returncode == 0, done.stderr
    return folder


def in_clone(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run this Python in a folder, with our packages on its path and a cache of its own."""
    return subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(folder / "cache")},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
@pytest.mark.parametrize("block", [b for b in blocks("python") if b.page != "README.md"], ids=str)
def test_python_in_the_documentation_runs(block: Block, clone: Path) -> None:
    done = in_clone(clone, "-W", "error", "-c", block.text)
    assert done.returncode == 0, done.stderr
    assert not done.stderr


@pytest.mark.slow
def test_python_of_the_readme_finds_the_robot(clone: Path) -> None:
    (block,) = (b for b in blocks("python") if b.page == "README.md")
    done = in_clone(clone, "-W", "error", "-c", block.text)
    assert done.returncode == 0, done.stderr
    last = (clone / "runs/first/estimate.tum").read_text().splitlines()[-1].split()
    assert "hint accepted - explains" in done.stdout
    assert f"x {float(last[1]):.3f} m, y {float(last[2]):.3f} m, tracking" in done.stdout


@pytest.mark.slow
def test_run_leaves_the_files_that_the_quick_start_lists(clone: Path) -> None:
    listed = {row[0].strip("`") for row in rows("docs/quickstart.md", "| file |")}
    assert listed == {path.name for path in (clone / "runs/first").iterdir()}


@pytest.mark.slow
def test_log_holds_the_topics_that_the_quick_start_lists(clone: Path) -> None:
    with (clone / "runs/first/readings.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    inside = {(c.topic, summary.schemas[c.schema_id].name) for c in summary.channels.values()}
    table = rows("docs/quickstart.md", "| topic |")
    assert inside == {(topic.strip("`"), kind.strip("`")) for topic, kind, *_ in table}


def commands() -> list[tuple[str, str]]:
    """Pages and the ``farsteer`` commands they name, whether through make or not."""
    found = []
    for page in PAGES:
        shell = [b.text for b in blocks("sh") if b.page == page]
        for line in (*(row for text in shell for row in text.splitlines()), *spans(page)):
            if words := re.match(r"(?:\.venv/bin/)?farsteer (.+)", line):
                found.append((page, words[1]))
            elif through := re.match(r'make (sim|map) ARGS="(.*)"', line):
                scene = "office " if through[1] == "map" else ""
                found.append((page, f"{through[1]} {scene}{through[2]}"))
    return [(page, words) for page, words in found if not words.endswith("...")]


@pytest.mark.parametrize(("page", "words"), commands())
def test_command_in_the_documentation_parses(page: str, words: str) -> None:
    arguments = shlex.split(words, comments=True)
    # A lone subcommand is a name in a sentence, and may want arguments.
    if len(arguments) == 1 and not arguments[0].startswith("-"):
        arguments.append("--help")
    if "--help" in arguments:
        with pytest.raises(SystemExit) as end:
            tyro.cli(Command, prog="farsteer", args=arguments)
        assert end.value.code == 0, page
    else:
        tyro.cli(Command, prog="farsteer", args=arguments)


def test_commands_are_found_in_the_documentation() -> None:
    assert len(commands()) > 10


@pytest.mark.parametrize("page", PAGES)
def test_make_targets_in_the_documentation_exist(page: str) -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"^([a-z]+):", makefile, re.MULTILINE))
    lines = [line for b in blocks("sh") if b.page == page for line in b.text.splitlines()]
    named = {m[1] for line in (*lines, *spans(page)) if (m := re.match(r"make ([a-z]+)", line))}
    assert named <= targets


@pytest.mark.parametrize("page", PAGES)
def test_files_in_the_documentation_exist(page: str) -> None:
    top = {path.name for path in ROOT.iterdir() if not path.name.startswith(".")} - {"runs"}
    folder = (ROOT / page).parent
    for span in spans(page):
        if re.fullmatch(r"[\w./-]+", span) and ("/" in span or span in top):
            first = span.split("/")[0]
            if first in top and not span.startswith("runs"):
                assert (ROOT / span).exists() or (folder / span).exists(), f"{page}: {span}"


def slug(heading: str) -> str:
    """The anchor of a heading."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


@pytest.mark.parametrize("page", PAGES)
def test_links_in_the_documentation_lead_somewhere(page: str) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
        if target.startswith("https://"):
            continue
        path, _, anchor = target.partition("#")
        file = ROOT / page if not path else (ROOT / page).parent / path
        assert file.exists(), f"{page}: {target}"
        assert file.resolve().is_relative_to(ROOT), f"{page}: {target}"
        if anchor:
            headings = re.findall(r"^#+ (.+)$", file.read_text(encoding="utf-8"), re.MULTILINE)
            assert anchor in map(slug, headings), f"{page}: {target}"


def test_mounts_in_the_documentation_are_the_robots() -> None:
    table = rows("docs/frames-and-time.md", "| frame in")
    told = {}
    for frame, position, angles in table:
        roll, pitch, yaw = (math.radians(float(a)) for a in angles.split(","))
        where = [float(x) for x in position.split(",")]
        told[frame.strip("`")] = Pose.from_euler(where, roll=roll, pitch=pitch, yaw=yaw)
    mounts = {**MOUNTS, "imu_link": IMU_MOUNT}
    assert told.keys() == mounts.keys()
    for frame, pose in mounts.items():
        np.testing.assert_allclose(told[frame].position, pose.position, atol=1e-12)
        np.testing.assert_allclose(told[frame].rotation, pose.rotation, atol=1e-12)


@pytest.mark.parametrize(("kind", "heading"), [(Health, "| state |"), (Verdict, "| verdict |")])
def test_every_state_and_verdict_is_explained(
    kind: type[Health] | type[Verdict], heading: str
) -> None:
    assert {row[0].strip("`") for row in rows("docs/localization.md", heading)} == set(kind)


@pytest.mark.parametrize("row", rows("docs/localization.md", "| setting |"), ids=lambda row: row[0])
def test_setting_has_the_value_that_the_documentation_gives(row: list[str]) -> None:
    value: object = LocalizerConfig()
    for name in row[0].strip("`").split("."):
        value = getattr(value, name)
    number, _, unit = row[1].partition(" ")
    told = float(number)
    if unit == "deg":
        told = math.radians(told)
    if unit == "s":
        told *= 1e9
    assert value == pytest.approx(told)


def test_pictures_in_the_documentation_are_small() -> None:
    assert all(p.stat().st_size < 250_000 for p in (ROOT / "docs/images").iterdir())
