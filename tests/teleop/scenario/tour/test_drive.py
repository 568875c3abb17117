"""A short tour within one process: its files, its report, and what becomes of it when it is cut short."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
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
from robot_sim import Simulation
from teleop.robot.inbox import InboxMessage
from teleop.robot.robot import Robot
from teleop.robot.tick_record import TickRecord
from teleop.scenario.files.scenario import Start
from teleop.scenario.run_files import RUN_FILES
from teleop.scenario.tour.drive import DrivenTour, drive_tour
from teleop.scenario.tour.measures import TickMeasures
from teleop.scenario.tour.options import TourOptions
from teleop.scenario.tour.picture import draw
from teleop.scenario.tour.report import summary_table
from teleop.scenario.tour.summary import ReportError, read_summary
from teleop.scene_clouds import load_scene_cloud, scene_cloud_path
from tests.teleop.scenario.tour.support import in_memory

Short = tuple[Path, DrivenTour]


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Short:
    folder = tmp_path_factory.mktemp("runs") / "short"
    return folder, drive_tour(in_memory(TourOptions(duration=6.0)), folder)


@pytest.mark.slow
def test_run_leaves_its_files(short: Short) -> None:
    folder, driven = short
    assert {p.name for p in folder.iterdir()} == {*RUN_FILES} - {
        "client.log",
        "operator.rrd",
        "steps.csv",
    }
    written = json.loads((folder / "summary.json").read_text())
    assert written["passed"] is driven.summary.passed is True
    assert written["facts"]["robot_seconds"] == 6.0
    assert json.loads((folder / "scenario.json").read_text())["world"]["scene"] == "office"
    outcome = json.loads((folder / "outcome.json").read_text())
    assert [(c["name"], c["value"]) for c in written["checks"]] == [
        (c["name"], c["value"]) for c in outcome["limits"]
    ]


@pytest.mark.slow
def test_log_holds_every_reading_that_the_localiser_got(short: Short) -> None:
    kinds = [type(r) for r in read_log(short[0] / "readings.mcap")]
    assert kinds.count(Inertial) == kinds.count(WheelSpeeds) == 300
    assert kinds.count(Scan) == 2 * 60
    assert kinds.count(Hint) == 1


def test_log_alone_gives_the_same_estimate_bit_for_bit(
    short: Short, cache: Path, tmp_path: Path
) -> None:
    done = localize(short[0] / "readings.mcap", scene_cloud_path("office"), cache=cache)
    write_tum(tmp_path / "estimate.tum", Trajectory.from_estimates(done.estimates))
    write_trace(tmp_path / "trace.csv", [TraceRow.of(e) for e in done.estimates])
    for name in ("estimate.tum", "trace.csv"):
        assert (tmp_path / name).read_bytes() == (short[0] / name).read_bytes()
    assert done.notes == ()
    assert len(done.verdicts) == len(short[1].summary.facts.verdicts) == 1


def test_evaluation_reprints_the_table_from_the_files(short: Short) -> None:
    folder, driven = short
    assert summary_table(read_summary(folder)) == summary_table(driven.summary)


def test_table_contains_all_results(short: Short) -> None:
    text = summary_table(short[1].summary)
    for word in (
        *("distance", "hint", "position", "heading", "NEES", "NIS", "health", "real time", "p99"),
        *(
            "simulation",
            "localiser",
            "registration",
            "log",
            "joy to motion",
            "/amcl_pose",
            "limits",
        ),
    ):
        assert word in text
    assert "MISSED" not in text


def test_referee_and_files_agree_about_the_errors(short: Short) -> None:
    summary = short[1].summary
    figures = {check.name: check.value for check in summary.checks}
    assert summary.ate is not None
    assert figures["position_rmse"] == pytest.approx(summary.ate.position.rmse, rel=0.05)
    assert figures["heading_rmse"] == pytest.approx(np.rad2deg(summary.ate.heading.rmse), rel=0.05)
    assert figures["nees"] == pytest.approx(summary.nees, rel=0.05)


def test_evaluation_of_something_else_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(ReportError, match="is not a run"):
        read_summary(tmp_path)
    (tmp_path / "summary.json").write_text('{"facts": {"scene": "office"}}')
    with pytest.raises(ReportError, match="damaged"):
        read_summary(tmp_path)


@pytest.mark.slow
def test_picture_is_drawn_from_a_run(short: Short) -> None:
    from matplotlib import image

    pixels = image.imread(short[0] / "run.png")
    assert pixels.shape[0] > 500
    assert pixels.shape[1] > 1000
    # Map, paths, cloud, errors and health bring more than a frame's few colours.
    assert len(np.unique(pixels.reshape(-1, pixels.shape[2]), axis=0)) > 200


@pytest.mark.slow
def test_axes_of_a_run_show_the_peaks_of_sigma_and_nothing_covers_the_health(
    short: Short, office_cloud: Cloud, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from matplotlib.figure import Figure

    figures: list[Figure] = []
    save = Figure.savefig

    def kept(figure: Figure, path: Path, dpi: int) -> None:
        figures.append(figure)
        save(figure, tmp_path / path.name, dpi=dpi)

    monkeypatch.setattr(Figure, "savefig", kept)
    draw(short[0], office_cloud, TickMeasures(), title="a short run")
    _, position, heading, _, health = figures[0].axes[:5]
    for axes, line in ((position, 1), (heading, 1)):
        sigma = np.asarray(axes.lines[line].get_ydata(), dtype=float)
        assert len(sigma) > 200
        # The first covariance is that of the hint.
        assert axes.get_ylim()[1] > np.max(sigma[len(sigma) // 50 :])
    legend = health.get_legend()
    assert legend is not None
    assert legend.get_window_extent().y1 < health.get_window_extent().y0


@pytest.mark.slow
def test_run_without_a_pose_is_drawn_and_misses_its_limits(tmp_path: Path) -> None:
    scenario = replace(in_memory(TourOptions(duration=0.5)), start=Start(known="nothing"))
    summary = drive_tour(scenario, tmp_path).summary
    assert summary.ate is None
    assert not summary.passed
    assert "no pose was ever estimated" in summary_table(summary)
    assert (tmp_path / "run.png").stat().st_size > 10_000


def _interrupted_at(stamp: int, monkeypatch: pytest.MonkeyPatch) -> None:
    tick = Robot.tick

    def interrupted(self: Robot, now: int, inbox: Sequence[InboxMessage]) -> TickRecord:
        if now == stamp:
            raise KeyboardInterrupt
        return tick(self, now, inbox)

    monkeypatch.setattr(Robot, "tick", interrupted)


@pytest.mark.slow
def test_interrupted_run_keeps_what_it_had(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _interrupted_at(2_000_000_000, monkeypatch)
    summary = drive_tour(in_memory(TourOptions()), tmp_path).summary
    assert summary.facts.ending == "interrupted"
    assert not summary.passed
    assert len(read_tum(tmp_path / "truth.tum")) == 100
    log = read_log(tmp_path / "readings.mcap")
    assert log.complete
    assert sum(isinstance(r, Inertial) for r in log) == 100
    assert "interrupted" in summary_table(read_summary(tmp_path))


def test_nothing_stays_of_a_run_that_is_interrupted_before_its_first_tick(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _interrupted_at(0, monkeypatch)
    with pytest.raises(KeyboardInterrupt):
        drive_tour(in_memory(TourOptions()), tmp_path / "run")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_unstable_physics_end_the_run_and_keep_its_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    step = Simulation.step

    def blown_up(self: Simulation) -> tuple[Reading, ...]:
        if self.stamp == 1_500_000_000:
            self._data.qvel[0] = np.nan
        return step(self)

    monkeypatch.setattr(Simulation, "step", blown_up)
    monkeypatch.chdir(tmp_path)
    summary = drive_tour(in_memory(TourOptions()), tmp_path / "run").summary
    assert "physics became unstable" in summary.facts.ending
    assert "1.500 s" in summary.facts.ending
    assert not summary.passed
    assert read_log(tmp_path / "run" / "readings.mcap").complete
    assert len(read_tum(tmp_path / "run" / "truth.tum")) == 75
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_scene_without_a_cloud_names_the_command_that_makes_one() -> None:
    with pytest.raises(CloudError, match="farsteer map nowhere"):
        load_scene_cloud("nowhere")
