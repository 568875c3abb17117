"""A short run: its files, its report, and what becomes of it when it is cut short."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from localization.evaluation.estimate_trace import TraceRow, write_trace
from localization.evaluation.trajectory import Trajectory
from localization.evaluation.tum_file import read_tum, write_tum
from localization.logs.mcap_log import read_log
from localization.maps.cloud import Cloud, CloudError
from localization.pipeline.log_replay import localize
from localization.types import Hint, Inertial, Reading, Scan, WheelSpeeds
from robot_sim import Simulation, World
from teleop.robot.inbox import InboxMessage
from teleop.robot.robot import Robot
from teleop.robot.tick_record import TickRecord
from teleop.scenario.mission import Mission
from teleop.scenario.mission_run import run_in_process
from teleop.scenario.run_picture import draw
from teleop.scenario.run_recorder import RunRecord
from teleop.scenario.run_report import summary_table
from teleop.scenario.run_summary import ReportError, RunSummary, read_summary
from teleop.scene_clouds import load_scene_cloud, scene_cloud_path

FILES = {"config.json", "summary.json", "truth.tum", "estimate.tum", "trace.csv", "readings.mcap"}


@pytest.fixture(scope="module")
def short(
    office: World, office_cloud: Cloud, cache: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, RunSummary, RunRecord]:
    folder = tmp_path_factory.mktemp("runs") / "short"
    summary, record = run_in_process(
        Mission(duration=6.0), office, office_cloud, folder, cache=cache
    )
    return folder, summary, record


def test_run_leaves_its_files(short: tuple[Path, RunSummary, RunRecord]) -> None:
    folder, summary, _ = short
    assert {p.name for p in folder.iterdir()} >= FILES
    written = json.loads((folder / "summary.json").read_text())
    assert written["passed"] is summary.passed is True
    assert written["facts"]["robot_seconds"] == 6.0
    config = json.loads((folder / "config.json").read_text())
    assert config["mission"]["scene"] == "office"
    assert config["localizer"]["registration"]["sigma"] > 0.0
    assert config["simulation"]["drive"]["max_speed"] == 0.7


def test_log_holds_every_reading_that_the_localiser_got(
    short: tuple[Path, RunSummary, RunRecord],
) -> None:
    kinds = [type(r) for r in read_log(short[0] / "readings.mcap")]
    assert kinds.count(Inertial) == kinds.count(WheelSpeeds) == 300
    assert kinds.count(Scan) == 2 * 60
    assert kinds.count(Hint) == 1


def test_log_alone_gives_the_same_estimate_bit_for_bit(
    short: tuple[Path, RunSummary, RunRecord], cache: Path, tmp_path: Path
) -> None:
    done = localize(short[0] / "readings.mcap", scene_cloud_path("office"), cache=cache)
    write_tum(tmp_path / "estimate.tum", Trajectory.from_estimates(done.estimates))
    write_trace(tmp_path / "trace.csv", [TraceRow.of(e) for e in done.estimates])
    for name in ("estimate.tum", "trace.csv"):
        assert (tmp_path / name).read_bytes() == (short[0] / name).read_bytes()
    assert done.notes == ()
    assert [v.verdict for v in done.verdicts] == [v.verdict for v in short[2].verdicts]


def test_evaluation_reprints_the_table_from_the_files(
    short: tuple[Path, RunSummary, RunRecord],
) -> None:
    folder, summary, _ = short
    assert summary_table(read_summary(folder)) == summary_table(summary)


def test_table_contains_all_results(short: tuple[Path, RunSummary, RunRecord]) -> None:
    text = summary_table(short[1])
    for word in ("distance", "hint", "position", "heading", "NEES", "health", "real time", "p99"):
        assert word in text
    assert "MISSED" not in text


def test_evaluation_of_something_else_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(ReportError, match="is not a run"):
        read_summary(tmp_path)
    (tmp_path / "summary.json").write_text('{"facts": {"scene": "office"}}')
    with pytest.raises(ReportError, match="damaged"):
        read_summary(tmp_path)


@pytest.mark.slow
def test_picture_is_drawn_from_a_run(
    short: tuple[Path, RunSummary, RunRecord], office_cloud: Cloud, tmp_path: Path
) -> None:
    from matplotlib import image

    draw(short[2], office_cloud, tmp_path / "run.png", title="a short run")
    pixels = image.imread(tmp_path / "run.png")
    assert pixels.shape[0] > 500
    assert pixels.shape[1] > 1000
    # Map, paths, cloud, errors and health bring more than a frame's few colours.
    assert len(np.unique(pixels.reshape(-1, pixels.shape[2]), axis=0)) > 200


@pytest.mark.slow
def test_axes_of_a_run_show_the_peaks_of_sigma_and_nothing_covers_the_health(
    short: tuple[Path, RunSummary, RunRecord],
    office_cloud: Cloud,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from matplotlib.figure import Figure

    figures: list[Figure] = []
    save = Figure.savefig

    def kept(figure: Figure, path: Path, dpi: int) -> None:
        figures.append(figure)
        save(figure, path, dpi=dpi)

    monkeypatch.setattr(Figure, "savefig", kept)
    draw(short[2], office_cloud, tmp_path / "run.png", title="a short run")
    _, position, heading, _, health = figures[0].axes[:5]
    for axes, line in ((position, 1), (heading, 1)):
        sigma = np.asarray(axes.lines[line].get_ydata(), dtype=float)
        # The first covariance is that of the hint.
        assert axes.get_ylim()[1] > np.max(sigma[len(sigma) // 50 :])
    legend = health.get_legend()
    assert legend is not None
    assert legend.get_window_extent().y1 < health.get_window_extent().y0


def test_picture_of_a_run_without_a_pose_is_drawn_as_well(
    short: tuple[Path, RunSummary, RunRecord], office_cloud: Cloud, tmp_path: Path
) -> None:
    early = RunRecord(short[2].ticks[:20], (), "interrupted")
    draw(early, office_cloud, tmp_path / "run.png", title="nothing yet")
    assert (tmp_path / "run.png").stat().st_size > 10_000


def test_interrupted_run_keeps_what_it_had(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tick = Robot.tick

    def interrupted(self: Robot, now: int, inbox: Sequence[InboxMessage]) -> TickRecord:
        if now == 2_000_000_000:
            raise KeyboardInterrupt
        return tick(self, now, inbox)

    monkeypatch.setattr(Robot, "tick", interrupted)
    summary, record = run_in_process(Mission(), office, office_cloud, tmp_path, cache=cache)
    assert record.ending == summary.facts.ending == "interrupted"
    assert not summary.passed
    assert len(read_tum(tmp_path / "truth.tum")) == 100
    log = read_log(tmp_path / "readings.mcap")
    assert log.complete
    assert sum(isinstance(r, Inertial) for r in log) == 100
    assert "interrupted" in summary_table(read_summary(tmp_path))


def test_unstable_physics_end_the_run_and_keep_its_files(
    office: World, office_cloud: Cloud, cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    step = Simulation.step

    def blown_up(self: Simulation) -> tuple[Reading, ...]:
        if self.stamp == 1_500_000_000:
            self._data.qvel[0] = np.nan
        return step(self)

    monkeypatch.setattr(Simulation, "step", blown_up)
    monkeypatch.chdir(tmp_path)
    summary, record = run_in_process(Mission(), office, office_cloud, tmp_path / "run", cache=cache)
    assert record.ending.startswith("physics became unstable at 1.500 s")
    assert not summary.passed
    assert read_log(tmp_path / "run" / "readings.mcap").complete
    assert len(read_tum(tmp_path / "run" / "truth.tum")) == 75
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_scene_without_a_cloud_names_the_command_that_makes_one() -> None:
    with pytest.raises(CloudError, match="farsteer map nowhere"):
        load_scene_cloud("nowhere")
