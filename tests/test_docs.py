"""The documentation is true: its code runs, its commands parse, its links and numbers hold."""

from __future__ import annotations

import math
import os
import re
import shlex
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tyro
from mcap.reader import make_reader

from benchmarks.sheets import pages
from localization import Health, LocalizerConfig, Pose, Verdict
from localization.display.rerun_sink import viewer_program
from robot_sim import IMU_MOUNT, MOUNTS, SimulationConfig
from teleop.command_line import Command
from teleop.operator.controls import keyboard
from teleop.operator.controls.repeat_timing import LONGEST_HOLD, SHORTEST_HOLD, RepeatTiming
from teleop.operator.operating_data import gears, operating_data, station_keys
from teleop.operator.robot_state.source_ages import STALE
from teleop.robot.lockstep_service import LockstepService
from teleop.robot.safety.control_state import ControlMode, SafetyConfig
from teleop.robot.safety.stale_commands import StaleLimits
from tests.warm_python import WarmPython

ROOT = Path(__file__).parents[1]
PAGES = [
    page.relative_to(ROOT).as_posix()
    for pattern in ("*.md", "docs/*.md", "docs/sheets/*.md", "scenes/*/README.md")
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
def clone(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> Path:
    """A folder like a clone after ``make sim ARGS="--out runs/first"``, but for a short drive."""
    folder = tmp_path_factory.mktemp("clone")
    (folder / "cache").symlink_to(cache.parent)
    (folder / "scenes").symlink_to(ROOT / "scenes")
    words = ("sim", "--duration", "5", "--out", "runs/first")
    done = in_clone(folder, "-m", "teleop", *words)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def python(clone: Path) -> Iterator[WarmPython]:
    """Runs programs; a warning is an error."""
    with WarmPython(environment_of(clone)) as warm:
        yield warm


def environment_of(folder: Path) -> dict[str, str]:
    """Our packages on Python's path, and the tests' cache of maps."""
    return {**os.environ, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(folder / "cache")}


def in_clone(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run this Python in a folder."""
    return subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env=environment_of(folder),
        capture_output=True,
        text=True,
        check=False,
    )


def block_with(page: str, text: str) -> Block:
    """The one Python block of a page that has a text in it."""
    (found,) = (b for b in blocks("python") if b.page == page and text in b.text)
    return found


LOCALIZE = block_with("README.md", "localize")
DRIVE = block_with("README.md", "roslibpy")
STEP = block_with("docs/teleoperation.md", "/sim/step")
PICTURE = block_with("docs/quickstart.md", "ViewerClient")
CAMERA = block_with("docs/cameras.md", "image_rect_color/compressed")
TUTORIAL = "docs/tutorial.md"
ALONE = [
    b
    for b in blocks("python")
    if b not in (LOCALIZE, DRIVE, STEP, PICTURE, CAMERA) and b.page != TUTORIAL
]


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.parametrize("block", ALONE, ids=str)
def test_python_in_the_documentation_runs(block: Block, clone: Path, python: WarmPython) -> None:
    done = python.run("-c", block.text, cwd=clone)
    assert done.returncode == 0, done.stderr
    assert not done.stderr


@pytest.mark.slow
def test_python_of_the_readme_finds_the_robot(clone: Path, python: WarmPython) -> None:
    done = python.run("-c", LOCALIZE.text, cwd=clone)
    assert done.returncode == 0, done.stderr
    last = (clone / "runs/first/estimate.tum").read_text().splitlines()[-1].split()
    assert "hint accepted - explains" in done.stdout
    assert f"x {float(last[1]):.3f} m, y {float(last[2]):.3f} m, tracking" in done.stdout


@pytest.mark.long
@pytest.mark.slow
def test_tutorial_leads_from_the_log_to_all_that_it_shows(clone: Path, python: WarmPython) -> None:
    (line,) = (
        line
        for b in blocks("sh")
        if b.page == TUTORIAL
        for line in b.text.splitlines()
        if "runs/first/readings.mcap" in line
    )
    done = in_clone(clone, "-W", "error", "-m", "teleop", *shlex.split(line)[1:])
    assert done.returncode == 0, done.stderr
    assert "ATE, position [mm]" in done.stdout
    listed = {row[0].strip("`") for row in rows(TUTORIAL, "| file |")}
    assert listed == {path.name for path in (clone / "runs/look").iterdir()}
    written = (clone / "runs/look/health.csv").read_text().split("\n", 1)[0].split(",")
    documented = {
        name for row in rows(TUTORIAL, "| column |") for name in re.findall(r"`(\w+)`", row[0])
    }
    assert documented <= set(written)
    assert {name for name in written if not re.fullmatch(r"observable_r?[xyz]", name)} <= documented
    for block in (b for b in blocks("python") if b.page == TUTORIAL):
        done = python.run("-c", block.text, cwd=clone)
        assert done.returncode == 0, f"{block}: {done.stderr}"
        assert done.stdout
        assert not done.stderr


@contextmanager
def served(folder: Path, *words: str) -> Iterator[str]:
    """Run ``farsteer serve`` on a free port; yield the port, and see that it ends well."""
    process = subprocess.Popen(
        [sys.executable, "-m", "teleop", "serve", "--port", "0", *words],
        env=environment_of(folder),
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        address = re.match(
            r"office at ws://127\.0\.0\.1:(\d+)$", process.stdout.readline().rstrip()
        )
        assert address is not None
        yield address[1]
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
    assert process.returncode == 0


@pytest.mark.long
@pytest.mark.slow
def test_program_in_the_readme_drives_the_robot(clone: Path) -> None:
    with served(clone) as port:
        done = in_clone(clone, "-c", DRIVE.text.replace("9090", port))
    assert done.returncode == 0, done.stderr
    # Where the machine holds the program up, the robot stops and says so: roslibpy prints that it knows no such operation.
    complaints = re.findall(r"^[\w.]+(?:Error|Exception): .*", done.stderr, re.MULTILINE)
    assert all('operation "status"' in complaint for complaint in complaints), done.stderr
    assert complaints or not done.stderr
    along = [float(x) for x in re.findall(r"^pose \{'x': ([\d.]+)", done.stdout, re.MULTILINE)]
    # It looks to the west. Half a metre is certain also where the machine is loaded.
    assert along[0] - along[-1] > 0.5
    assert re.search(r"^cloud of \d{3,} points$", done.stdout, re.MULTILINE)


@pytest.mark.long
@pytest.mark.slow
def test_program_in_the_documentation_looks_through_the_camera(
    clone: Path, python: WarmPython
) -> None:
    with served(clone, "--camera", "kinect") as port:
        done = python.run("-c", CAMERA.text.replace("9090", port), cwd=clone)
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    assert "(640, 480)" in done.stdout


@pytest.mark.slow
def test_program_in_the_documentation_steps_the_robot(clone: Path, python: WarmPython) -> None:
    with served(clone, "--lockstep") as port:
        done = python.run("-c", STEP.text.replace("9090", port), cwd=clone)
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    assert done.stdout == "2 s, 19 poses, the last at x 23.46 m\n"


@pytest.mark.slow
def test_program_in_the_documentation_takes_a_picture(clone: Path) -> None:
    if not any(Path("/usr/share/vulkan/icd.d").glob("*.json")):
        pytest.skip("no Vulkan driver: apt-get install mesa-vulkan-drivers")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    (line,) = (
        line
        for b in blocks("sh")
        for line in b.text.splitlines()
        if line.startswith(".venv/bin/rerun --headless")
    )
    viewer = subprocess.Popen(
        [viewer_program(), *shlex.split(line)[1:], "--port", port],
        cwd=clone,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        until_listening(int(port))
        url = f'"rerun+http://127.0.0.1:{port}/proxy"'
        done = in_clone(clone, "-c", PICTURE.text.replace("connect()", f"connect({url})"))
        assert done.returncode == 0, done.stderr
    finally:
        viewer.kill()
        viewer.wait()
    assert (clone / "operator.png").stat().st_size > 100_000


def until_listening(port: int) -> None:
    """Wait until somebody listens."""
    for _ in range(300):
        with socket.socket() as probe:
            probe.settimeout(1.0)
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.1)
    raise TimeoutError(f"nobody listens on port {port}")


@pytest.mark.slow
def test_run_leaves_the_files_that_the_quick_start_lists(clone: Path) -> None:
    cells = [row[0] for row in rows("docs/quickstart.md", "| file |")]
    listed = {name for cell in cells for name in re.findall(r"`(.+?)`", cell)}
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
            elif through := re.match(r'make (sim|map|serve|operate|world) ARGS="(.*?)"', line):
                scene = "office " if through[1] == "map" else ""
                found.append((page, f"{through[1]} {scene}{through[2]}"))
    return [(page, words) for page, words in found if not words.endswith("...")]


def make_targets() -> set[str]:
    return set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))


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


def test_commands_in_the_documentation_run_as_they_are_typed() -> None:
    """A command of the environment is found in it, or through make."""
    bare = [
        f"{block}: {line}"
        for block in blocks("sh")
        for line in block.text.splitlines()
        if re.match(r"(farsteer|python|pip|rerun|pytest) ", line)
    ]
    assert not bare


def test_readme_says_what_the_first_make_says() -> None:
    said = re.search(r"downloads (\d+ MB), takes (\d\.\d GB)", text_of("Makefile"))
    assert said is not None
    for page in ("README.md", "docs/quickstart.md"):
        text = " ".join(text_of(page).split())
        assert f"{said[1]} to download, {said[2]} on the disk" in text


def test_commands_are_found_in_the_documentation() -> None:
    assert len(commands()) > 10


@pytest.mark.parametrize("page", PAGES)
def test_make_targets_in_the_documentation_exist(page: str) -> None:
    lines = [line for b in blocks("sh") if b.page == page for line in b.text.splitlines()]
    named = {m[1] for line in (*lines, *spans(page)) if (m := re.match(r"make ([a-z]+)", line))}
    assert named <= make_targets()


def test_readme_names_the_targets_that_begin() -> None:
    block = next(b for b in blocks("sh") if b.page == "README.md")
    assert re.findall(r"^make (\w+)", block.text, re.MULTILINE) == [
        "serve", "sim", "operate", "test",
    ]  # fmt: skip


@pytest.mark.parametrize("page", PAGES)
def test_files_in_the_documentation_exist(page: str) -> None:
    made = {"runs", "build", "dist"}  # by commands, where they have been run
    top = {path.name for path in ROOT.iterdir() if not path.name.startswith(".")} - made
    folder = (ROOT / page).parent
    for span in spans(page):
        if re.fullmatch(r"[\w./-]+", span) and ("/" in span or span in top):
            first = span.split("/")[0]
            if first in top:
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
    documented = {}
    for frame, position, angles in table:
        roll, pitch, yaw = (math.radians(float(a)) for a in angles.split(","))
        where = [float(x) for x in position.split(",")]
        documented[frame.strip("`")] = Pose.from_euler(where, roll=roll, pitch=pitch, yaw=yaw)
    mounts = {**MOUNTS, "imu_link": IMU_MOUNT}
    assert documented.keys() == mounts.keys()
    for frame, pose in mounts.items():
        np.testing.assert_allclose(documented[frame].position, pose.position, atol=1e-12)
        np.testing.assert_allclose(documented[frame].rotation, pose.rotation, atol=1e-12)


@pytest.mark.parametrize(
    ("page", "kind", "heading"),
    [
        ("docs/health.md", Health, "| state |"),
        ("docs/localization.md", Verdict, "| verdict |"),
        ("docs/teleoperation.md", ControlMode, "| control |"),
    ],
)
def test_every_state_and_verdict_is_explained(
    page: str, kind: type[Health] | type[Verdict] | type[ControlMode], heading: str
) -> None:
    assert {row[0].strip("`") for row in rows(page, heading)} == set(kind)


def test_tables_of_figures_are_those_of_the_sheets() -> None:
    for sheet, text in pages.SHEETS.items():
        shown = sheet.read_text(encoding="utf-8")
        assert shown == pages.page(text), "run: python -m benchmarks.sheets"


@pytest.mark.parametrize("row", rows("docs/localization.md", "| setting |"), ids=lambda row: row[0])
def test_setting_has_the_value_that_the_documentation_gives(row: list[str]) -> None:
    value: object = LocalizerConfig()
    for name in row[0].strip("`").split("."):
        value = getattr(value, name)
    assert value == pytest.approx(value_in(row[1], seconds=1e9))


def value_in(cell: str, *, seconds: float = 1.0) -> float:
    """The number in a cell, in the units of the code."""
    number, _, unit = cell.partition(" ")
    factors = {"deg": math.pi / 180, "deg/s": math.pi / 180, "s": seconds, "MB": 1e6}
    return float(number) * factors.get(unit, 1.0)


SAFETY: dict[str, SafetyConfig | StaleLimits] = {
    "| safety |": SafetyConfig(),
    "| old commands |": StaleLimits(),
}
"""Settings by the heads of their tables; those of the wire are in a sheet, which is compared whole."""


@pytest.mark.parametrize("heading", SAFETY)
def test_safety_has_the_settings_and_values_that_the_documentation_gives(heading: str) -> None:
    config = SAFETY[heading]
    given = {row[0].strip("`"): row[1] for row in rows("docs/teleoperation.md", heading)}
    assert given.keys() == {field.name for field in fields(config)} - {"stale"}
    for name, cell in given.items():
        assert getattr(config, name) == pytest.approx(value_in(cell, seconds=1e9)), name


def test_steps_are_as_many_as_the_documentation_says() -> None:
    page = " ".join(text_of("docs/teleoperation.md").split())
    assert f"`ticks` from 1 to {LockstepService.MAX_TICKS} of 20 ms" in page
    assert f"at most {LockstepService.MAX_BRAKING_TICKS} ticks" in page


def listed(entries: Iterable[Mapping[str, Any]], name: str) -> list[list[str]]:
    return [[entry[name], entry["does"]] for entry in entries]


def test_keys_and_buttons_are_those_that_station_and_page_read() -> None:
    keys, pad = (operating_data("controls")[name] for name in ("keys", "gamepad"))
    assert rows("docs/quickstart.md", "| key |") == listed(station_keys(), "keys")
    buttons = [use for use in pad["buttons"].values() if use.get("only") != "page"]
    assert rows("docs/operating.md", "| button |") == listed(buttons, "name")
    pages = [key for key in keys if key.get("only") != "station"]
    assert rows("docs/console.md", "| key |") == listed(pages, "keys")


def test_alarms_are_those_that_station_and_page_raise() -> None:
    rules = operating_data("alarms")["rules"]
    assert [row[0].strip("`") for row in rows("docs/operating.md", "| alarm |")] == [
        rule["kind"] for rule in rules
    ]
    for rule, row in zip(rules, rows("docs/operating.md", "| alarm |"), strict=True):
        assert row[1] == rule["severity"]


def test_operating_page_gives_the_gears_and_times_of_the_code() -> None:
    page = " ".join(text_of("docs/operating.md").split())
    table = [
        (row[0], float(row[1]), float(row[2])) for row in rows("docs/operating.md", "| gear |")
    ]
    assert table == [(g.name, round(g.speed, 6), round(g.turn, 6)) for g in gears()]
    timing = RepeatTiming()
    assert f"A tap then drives for {timing.first_hold / 1e9:.2f} s" in page
    hold = SHORTEST_HOLD / 1e9, LONGEST_HOLD / 1e9
    assert "{:g} to {:g} s".format(*hold) in page
    assert f"not answered for {keyboard.TERMINAL_SILENCE / 1e9:g} s" in page
    assert f"turns grey {STALE / 1e9:g} s after the last one" in page


def test_beam_without_return_is_as_far_as_the_documentation_says() -> None:
    page = " ".join(text_of("docs/frames-and-time.md").split())
    for scanner in SimulationConfig().scanners:
        assert f"{scanner.range_max + 1:g} m for these scanners" in page


def test_pictures_in_the_documentation_are_small() -> None:
    sizes = {path.name: path.stat().st_size for path in (ROOT / "docs/images").iterdir()}
    for name, size in sizes.items():
        assert size < (1_200_000 if name.endswith(".webp") else 250_000), name  # an animation
    assert sum(sizes.values()) <= 3_000_000


def test_pictures_of_the_documentation_are_shown() -> None:
    shown = {name for page in PAGES for name in re.findall(r"images/([\w.-]+)\)", text_of(page))}
    assert {path.name for path in (ROOT / "docs/images").iterdir()} == shown


def test_pages_are_as_short_as_they_should_be() -> None:
    """Words have a letter or a digit: the bars of tables are none."""
    written = {
        "README.md",
        "CONTRIBUTING.md",
        *(p for p in PAGES if re.fullmatch(r"docs/[\w-]+\.md", p)),
    }
    pages = written - {"docs/settings.md", "docs/topics.md"}
    words = sum(bool(re.search(r"\w", word)) for page in pages for word in text_of(page).split())
    assert words <= 45_000
    assert len(text_of("README.md").splitlines()) <= 200


@pytest.mark.parametrize("page", [p for p in PAGES if re.fullmatch(r"docs/\w[\w-]*\.md", p)])
def test_page_says_its_purpose_first(page: str) -> None:
    first = text_of(page).split("\n\n")[1]
    assert re.match(r"\*(Tutorial|How-to|Reference|Explanation)\.\* ", first), page
