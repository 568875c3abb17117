"""Recorder of a run: keeps each tick, writes the log and the files, and computes the results."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from localization.config import to_json
from localization.evaluation.estimate_trace import TraceRow, write_trace
from localization.evaluation.trajectory import Trajectory
from localization.evaluation.tum_file import write_tum
from localization.logs.mcap_writer import ReadingsWriter
from localization.maps.cloud import Cloud
from localization.pipeline.localizer import LocalizerConfig
from localization.pipeline.log_replay import config_metadata
from localization.types import SECOND, HintVerdict
from robot_sim import TICK_NS, Simulation, SimulationConfig
from teleop.clock import Stopwatch, wall_seconds
from teleop.robot.inbox import DriveCommand
from teleop.robot.tick_record import TickRecord
from teleop.scenario.mission import Mission
from teleop.scenario.run_summary import (
    ReportError,
    RunFacts,
    RunSummary,
    StageTime,
    TopicTraffic,
    summarise,
)

_MOVING = 0.01
"""Speed above which the robot counts as moving [m/s] or [rad/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class RunRecord:
    """Data from which the files and the picture of a run are made."""

    ticks: Sequence[TickRecord]
    """Record of each tick, without readings and inbox."""
    verdicts: tuple[HintVerdict, ...]
    """Verdicts about hints, in order."""
    ending: str
    """``completed``, or why the run ended before that."""


class RunRecorder:
    """Owns a run's folder; as a context manager it completes the log in any case.

    Of a run that ends before its first tick nothing stays.
    """

    def __init__(
        self,
        folder: Path,
        mission: Mission,
        simulation: Simulation,
        cloud: Cloud,
        watch: Stopwatch,
        *,
        localizer_config: LocalizerConfig,
        startup_seconds: float,
    ) -> None:
        """Create the folder, write the configuration and open the log.

        Args:
            folder: Folder of the run.
            mission: The mission that is driven.
            simulation: The simulated robot, before its first tick.
            cloud: The robot's map.
            watch: Wall times of the robot's stages.
            localizer_config: Settings of the localiser.
            startup_seconds: Wall time of preparing map and robot [s].
        """
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, self.mission, self._cloud, self._watch = folder, mission, cloud, watch
        self._startup, self._begun = startup_seconds, wall_seconds()
        self._write_config(simulation.config, localizer_config)
        metadata = {
            "scene": mission.scene,
            "seed": str(mission.seed),
            "map_sha256": cloud.sha256,
            **config_metadata(localizer_config),
        }
        self._log = ReadingsWriter(
            folder / "readings.mcap",
            simulation.mounts,
            metadata,
            wheel_radius=simulation.world.robot.rolling_radius,
        )
        self._ticks: list[TickRecord] = []
        self._verdicts: list[HintVerdict] = []
        tour = np.array(simulation.world.tour)
        self._length = float(np.linalg.norm(np.diff(tour, axis=0), axis=1).sum())
        self._limits = mission.limits.for_tour(self._length)
        self._driven = 0.0
        self._requested: int | None = None
        self._latencies: list[float] = []

    def __enter__(self) -> RunRecorder:
        return self

    def __exit__(self, *_: object) -> None:
        self._log.close()
        if not self._ticks:
            self._discard()

    def _discard(self) -> None:
        """Remove the files of a run that did not begin, and its folder unless it holds other files."""
        for name in ("config.json", "operator.json", "operator.rrd", "readings.mcap"):
            (self.folder / name).unlink(missing_ok=True)
        with contextlib.suppress(OSError):
            self.folder.rmdir()

    def take(self, tick: TickRecord) -> None:
        """Record one tick."""
        with self._watch.stage("log"):
            for reading in tick.readings:
                self._log.write(reading, tick.stamp)
        self._verdicts += [e.verdict for e in tick.estimates if e.verdict is not None]
        self._measure_latency(tick)
        self._driven += float(np.hypot(*tick.truth.twist.linear[:2])) * TICK_NS / SECOND
        # Readings are in the log and need not be kept; sweeps stay for the picture.
        self._ticks.append(replace(tick, drive=replace(tick.drive, sensed=(), inbox=())))

    @property
    def begun(self) -> bool:
        """Whether there was a tick."""
        return bool(self._ticks)

    @property
    def progress(self) -> float:
        """Completed share of the mission: of its duration if it has one, else of the tour's length."""
        if not self._ticks:
            return 0.0
        if self.mission.duration is not None:
            return min(1.0, self._ticks[-1].stamp / SECOND / self.mission.duration)
        return min(1.0, self._driven / self._length)

    @property
    def factor(self) -> float:
        """Robot time over wall time so far."""
        if not self._ticks:
            return 0.0
        return self._ticks[-1].stamp / SECOND / max(1e-9, wall_seconds() - self._begun)

    def _measure_latency(self, tick: TickRecord) -> None:
        """Measure the time from a request that ends a standstill to the first motion."""
        moving = _moves(tick)
        still_before = not self._ticks or not _moves(self._ticks[-1])
        commands = [m for m in tick.inbox if isinstance(m, DriveCommand) and not m.request.neutral]
        twist = tick.control.twist
        commanded = bool(twist.linear.any() or twist.angular.any())
        if self._requested is None and still_before and commands and commanded:
            self._requested = commands[-1].stamp or tick.stamp - TICK_NS
        if self._requested is not None and moving:
            self._latencies.append((tick.stamp - self._requested) / SECOND)
            self._requested = None
        elif not commanded:
            self._requested = None

    def finish(
        self, ending: str, traffic: Sequence[TopicTraffic] = ()
    ) -> tuple[RunSummary, RunRecord]:
        """Write the files and return the results.

        Args:
            ending: ``completed``, or why the run ended before that.
            traffic: Messages sent over the socket, by topic.

        Raises:
            ReportError: If there was not a single tick.
        """
        if not self._ticks:
            raise ReportError(f"the run ended before it began: {ending}")
        wall = wall_seconds() - self._begun
        self._log.close()
        record = RunRecord(self._ticks, tuple(self._verdicts), ending)
        estimates = [e for tick in self._ticks for e in tick.estimates]
        write_tum(self.folder / "estimate.tum", Trajectory.from_estimates(estimates))
        truths = [(tick.stamp, tick.truth.map_from_base) for tick in self._ticks]
        write_tum(self.folder / "truth.tum", Trajectory.from_poses(truths))
        write_trace(self.folder / "trace.csv", [TraceRow.of(e) for e in estimates])
        facts = RunFacts(
            scene=self.mission.scene,
            seed=self.mission.seed,
            map_sha256=self._cloud.sha256,
            ending=ending,
            verdicts=tuple(_verdict_line(v) for v in self._verdicts),
            robot_seconds=self._ticks[-1].stamp / SECOND,
            wall_seconds=wall,
            startup_seconds=self._startup,
            stages=tuple(StageTime.of(name, laps) for name, laps in self._watch.laps.items()),
            traffic=tuple(traffic),
            joy_to_motion=tuple(self._latencies),
            limits=self._limits,
            whole_tour=self.mission.duration is None,
        )
        summary = summarise(self.folder, facts)
        _write_json(self.folder / "summary.json", summary.to_json())
        return summary, record

    def _write_config(self, simulation: SimulationConfig, localizer: LocalizerConfig) -> None:
        values = {
            "mission": asdict(self.mission),
            "simulation": asdict(simulation),
            "localizer": to_json(localizer),
        }
        _write_json(self.folder / "config.json", values)


def _moves(tick: TickRecord) -> bool:
    twist = tick.truth.twist
    return bool(np.abs(twist.linear[:2]).max() > _MOVING or abs(twist.angular[2]) > _MOVING)


def _verdict_line(verdict: HintVerdict) -> str:
    after = (verdict.stamp - verdict.hint.stamp) / SECOND
    line = f"{verdict.verdict.value} after {after:.2f} s: {verdict.reason}"
    if verdict.candidates:
        moved = verdict.candidates[0].map_from_base.position - verdict.hint.map_from_base.position
        line += f", {float(np.hypot(moved[0], moved[1])):.2f} m from the hint"
    return line


def _write_json(path: Path, value: object) -> None:
    path.write_text(json.dumps(value, indent=2) + "\n", encoding="utf-8")
