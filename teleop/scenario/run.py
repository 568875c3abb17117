"""Run a mission in one process, in lockstep, and leave everything about it in a folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.resources import files
from pathlib import Path

import numpy as np

from localization.cloud import Cloud, CloudError, load_cloud
from localization.localizer import Localizer, LocalizerConfig
from localization.log import ReadingsWriter
from localization.prepared import prepare
from localization.replay import CONFIG_KEY, to_json
from localization.trace import TraceRow, write_trace
from localization.trajectory import Trajectory, write_tum
from localization.types import SECOND, HintVerdict
from robot_sim import DriveConfig, PhysicsError, Simulation, SimulationConfig, World
from teleop.pacing import Stopwatch, wall_seconds
from teleop.robot.joystick import Wish
from teleop.robot.robot import Drive, Message, Robot, Snapshot
from teleop.scenario.driver import TourDriver
from teleop.scenario.mission import HINT_STAMP, Mission
from teleop.scenario.report import RunFacts, StageTime, Summary, summarise

Progress = Callable[[float, str], None]
"""Called now and then with the share done and a line of text."""


@dataclass(frozen=True, slots=True, eq=False)
class RunRecord:
    """What the pictures and files of a run are made from."""

    snapshots: Sequence[Snapshot]
    verdicts: tuple[HintVerdict, ...]
    ending: str
    """``completed``, or why the run ended before that."""


def cloud_path(scene: str) -> Path:
    """Return where a scene's cloud lies, or would."""
    return Path(str(files("scenes") / scene / "cloud.ply"))


def cloud_of(scene: str) -> Cloud:
    """Load the prebuilt cloud of a scene.

    Raises:
        CloudError: if the scene has none; ``farsteer map`` makes one.
    """
    path = cloud_path(scene)
    if not path.is_file():
        raise CloudError(f"scene {scene!r} has no cloud yet: run `farsteer map {scene}`")
    return load_cloud(path)


def run(
    mission: Mission,
    world: World,
    cloud: Cloud,
    folder: Path,
    *,
    cache: Path | None = None,
    progress: Progress = lambda share, text: None,
) -> tuple[Summary, RunRecord]:
    """Drive a mission and write its files, also when it is interrupted or the physics fail.

    Args:
        mission: what to do.
        world: the mission's scene.
        cloud: its prebuilt cloud.
        folder: where the files go; made if need be.
        cache: folder for derived files.
        progress: told how far the tour is.

    Returns:
        The summary, as written, and the run itself.
    """
    begun = wall_seconds()
    folder.mkdir(parents=True, exist_ok=True)
    watch = Stopwatch()
    simulation_config = SimulationConfig(drive=DriveConfig(slips=mission.slips))
    localizer_config = LocalizerConfig()
    simulation = Simulation(world, seed=mission.seed, config=simulation_config)
    progress(0.0, "preparing the map")
    localizer = Localizer(
        prepare(cloud, cache=cache), simulation.mounts, localizer_config, stage=watch.stage
    )
    robot = Robot(simulation, localizer, stage=watch.stage)
    _write_json(
        folder / "config.json",
        {
            "mission": asdict(mission),
            "simulation": asdict(simulation_config),
            "localizer": to_json(localizer_config),
        },
    )
    metadata = {
        "scene": mission.scene,
        "seed": str(mission.seed),
        "map_sha256": cloud.sha256,
        CONFIG_KEY: json.dumps(to_json(localizer_config)),
    }
    ready = wall_seconds()
    with ReadingsWriter(folder / "readings.mcap", simulation.mounts, metadata) as log:
        record = _drive(mission, robot, log, watch, progress)
    ended = wall_seconds()

    estimates = [e for s in record.snapshots for e in s.estimates]
    write_tum(folder / "estimate.tum", Trajectory.from_estimates(estimates))
    truths = [(s.stamp, s.truth.map_from_base) for s in record.snapshots]
    write_tum(folder / "truth.tum", Trajectory.from_poses(truths))
    write_trace(folder / "trace.csv", [TraceRow.of(e) for e in estimates])
    driven = record.snapshots[-1].stamp / SECOND if record.snapshots else 0.0
    facts = RunFacts(
        scene=mission.scene,
        seed=mission.seed,
        map_sha256=cloud.sha256,
        ending=record.ending,
        verdicts=tuple(_verdict_line(v) for v in record.verdicts),
        robot_seconds=driven,
        wall_seconds=ended - ready,
        startup_seconds=ready - begun,
        stages=tuple(StageTime.of(name, laps) for name, laps in watch.laps.items()),
        limits=mission.limits,
        whole_tour=mission.duration is None,
    )
    summary = summarise(folder, facts)
    _write_json(folder / "summary.json", summary.to_json())
    return summary, record


def _drive(
    mission: Mission, robot: Robot, log: ReadingsWriter, watch: Stopwatch, progress: Progress
) -> RunRecord:
    """Tick until the tour is done, time is up, or something ends it."""
    driver = TourDriver(robot.simulation.world.tour)
    hint = mission.hint(robot.simulation.truth().map_from_base)
    snapshots: list[Snapshot] = []
    verdicts: list[HintVerdict] = []
    inbox: list[Message] = []
    ending = "completed"
    begun = wall_seconds()
    try:
        while not driver.done:
            now = robot.simulation.stamp
            if now >= mission.time_limit:
                ending = "completed" if mission.duration else "out of time before the tour's end"
                break
            if now == HINT_STAMP:
                inbox.append(hint)
            snapshot = robot.tick(now, inbox)
            with watch.stage("log"):
                for reading in snapshot.readings:
                    log.write(reading, snapshot.stamp)
            snapshots.append(_light(snapshot))
            estimate = snapshot.estimate
            verdicts += [e.verdict for e in snapshot.estimates if e.verdict is not None]
            twist = driver.command(estimate.map_from_base, estimate.health)
            inbox = [Drive("script", Wish(twist, enabled=True))]
            if snapshot.stamp % SECOND == 0:
                factor = snapshot.stamp / SECOND / (wall_seconds() - begun)
                share = driver.progress
                if mission.duration:
                    share = snapshot.stamp / mission.time_limit
                seconds = snapshot.stamp // SECOND
                progress(share, f"{seconds} s driven at {factor:.1f}x, {estimate.health}")
    except KeyboardInterrupt:
        ending = "interrupted"
    except PhysicsError as error:
        ending = str(error)
    return RunRecord(snapshots, tuple(verdicts), ending)


def _light(snapshot: Snapshot) -> Snapshot:
    """Drop what was logged already; sweeps stay for the picture."""
    return replace(snapshot, readings=())


def _verdict_line(verdict: HintVerdict) -> str:
    after = (verdict.stamp - verdict.hint.stamp) / SECOND
    line = f"{verdict.verdict.value} after {after:.2f} s: {verdict.reason}"
    if verdict.candidates:
        moved = verdict.candidates[0].map_from_base.position - verdict.hint.map_from_base.position
        line += f", {float(np.hypot(moved[0], moved[1])):.2f} m from the hint"
    return line


def _write_json(path: Path, value: object) -> None:
    path.write_text(json.dumps(value, indent=2) + "\n", encoding="utf-8")
