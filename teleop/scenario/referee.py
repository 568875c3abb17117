"""The referee: sees every snapshot, keeps the log, and writes what a run came to."""

from __future__ import annotations

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
from teleop.robot.robot import Drive, Snapshot
from teleop.scenario.mission import Mission
from teleop.scenario.run_report import (
    ReportError,
    RunFacts,
    StageTime,
    Summary,
    TopicTraffic,
    summarise,
)

_MOVING = 0.01
"""Faster than this, in m/s or rad/s, is motion."""


@dataclass(frozen=True, slots=True, eq=False)
class RunRecord:
    """What the pictures and files of a run are made from."""

    snapshots: Sequence[Snapshot]
    verdicts: tuple[HintVerdict, ...]
    ending: str
    """``completed``, or why the run ended before that."""


class Referee:
    """Owns a run's folder; use it in a ``with`` block, which completes the log whatever happens."""

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
        self._snapshots: list[Snapshot] = []
        self._verdicts: list[HintVerdict] = []
        tour = np.array(simulation.world.tour)
        self._length = float(np.linalg.norm(np.diff(tour, axis=0), axis=1).sum())
        self._limits = mission.limits.for_tour(self._length)
        self._driven = 0.0
        self._wished: int | None = None
        self._latencies: list[float] = []

    def __enter__(self) -> Referee:
        return self

    def __exit__(self, *_: object) -> None:
        self._log.close()

    def take(self, snapshot: Snapshot) -> None:
        """Note one tick."""
        with self._watch.stage("log"):
            for reading in snapshot.readings:
                self._log.write(reading, snapshot.stamp)
        self._verdicts += [e.verdict for e in snapshot.estimates if e.verdict is not None]
        self._watch_latency(snapshot)
        self._driven += float(np.hypot(*snapshot.truth.twist.linear[:2])) * TICK_NS / SECOND
        # What was logged need not be kept; sweeps stay for the picture.
        self._snapshots.append(replace(snapshot, readings=(), inbox=()))

    @property
    def progress(self) -> float:
        """Share of the mission that is done: of its time if that is given, else of the way."""
        if not self._snapshots:
            return 0.0
        if self.mission.duration is not None:
            return min(1.0, self._snapshots[-1].stamp / SECOND / self.mission.duration)
        return min(1.0, self._driven / self._length)

    @property
    def factor(self) -> float:
        """How much faster than real time the run is so far."""
        if not self._snapshots:
            return 0.0
        return self._snapshots[-1].stamp / SECOND / max(1e-9, wall_seconds() - self._begun)

    def _watch_latency(self, snapshot: Snapshot) -> None:
        """Time from the wish that ends a standstill to the motion that answers it."""
        moving = _moves(snapshot)
        still_before = not self._snapshots or not _moves(self._snapshots[-1])
        wishes = [m for m in snapshot.inbox if isinstance(m, Drive) and not m.wish.neutral]
        commanded = bool(
            snapshot.control.twist.linear.any() or snapshot.control.twist.angular.any()
        )
        if self._wished is None and still_before and wishes and commanded:
            self._wished = wishes[-1].stamp or snapshot.stamp - TICK_NS
        if self._wished is not None and moving:
            self._latencies.append((snapshot.stamp - self._wished) / SECOND)
            self._wished = None
        elif not commanded:
            self._wished = None

    def finish(
        self, ending: str, traffic: Sequence[TopicTraffic] = ()
    ) -> tuple[Summary, RunRecord]:
        """Write the files and return what they say.

        Raises:
            ReportError: if there was not a single tick.
        """
        if not self._snapshots:
            raise ReportError(f"the run ended before it began: {ending}")
        wall = wall_seconds() - self._begun
        self._log.close()
        record = RunRecord(self._snapshots, tuple(self._verdicts), ending)
        estimates = [e for s in self._snapshots for e in s.estimates]
        write_tum(self.folder / "estimate.tum", Trajectory.from_estimates(estimates))
        truths = [(s.stamp, s.truth.map_from_base) for s in self._snapshots]
        write_tum(self.folder / "truth.tum", Trajectory.from_poses(truths))
        write_trace(self.folder / "trace.csv", [TraceRow.of(e) for e in estimates])
        facts = RunFacts(
            scene=self.mission.scene,
            seed=self.mission.seed,
            map_sha256=self._cloud.sha256,
            ending=ending,
            verdicts=tuple(_verdict_line(v) for v in self._verdicts),
            robot_seconds=self._snapshots[-1].stamp / SECOND,
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


def _moves(snapshot: Snapshot) -> bool:
    twist = snapshot.truth.twist
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
