"""The folder of a run: its scenario, what the robot received and measured, and its trajectories."""

from __future__ import annotations

from collections import deque
from pathlib import Path

from localization.evaluation.estimate_trace import TraceRow, write_trace
from localization.evaluation.trajectory import Trajectory
from localization.evaluation.tum_file import TumWriter, write_tum
from localization.logs.mcap_writer import ReadingsWriter
from localization.pipeline.localizer import LocalizerConfig
from localization.pipeline.log_replay import config_metadata
from localization.types import Pose
from robot_sim import World
from teleop.robot.steps.precision_log import STEPS_FILE, PrecisionLog, StepsWriter
from teleop.robot.tick_record import TickRecord
from teleop.scenario.files.scenario import SCHEMA, Scenario
from teleop.scenario.referee.outcome import Event
from teleop.scenario.session.inbox_file import InboxWriter
from teleop.scenario.session.referee_notes import Ending, NotesWriter
from teleop.scenario.session.scene import Scene, simulation_config

SCENARIO = "scenario.json"
"""The scenario as it was run."""
INBOX = "inbox.jsonl"
"""What clients and faults wanted of the robot, tick by tick."""
NOTES = "notes.jsonl"
"""What the referee noted of clients, and how the run ended."""
CLIENT_LOG = "client.log"
"""What the client under test printed."""
READINGS = "readings.mcap"
"""The robot's measurements."""
TRUTH = "truth.tum"
"""True poses, one a tick."""


class RunFolder:
    """Owns the files of a run; whatever happens, what was recorded stays."""

    def __init__(self, path: Path, scenario: Scenario, scene: Scene) -> None:
        """Create the folder and open its files."""
        path.mkdir(parents=True, exist_ok=True)
        self.path = path
        (path / SCENARIO).write_bytes(SCHEMA.dump_json(scenario, indent=2) + b"\n")
        self._inbox = InboxWriter(path / INBOX)
        self._precision, self._steps = PrecisionLog(), StepsWriter(path / STEPS_FILE)
        self._readings = _readings(path / READINGS, scenario, scene)
        self._truth, self._notes = TumWriter(path / TRUTH), NotesWriter(path / NOTES)
        self._unwritten: deque[tuple[int, TickRecord]] = deque()
        # Not the estimates, which hold their sweeps.
        self._guesses: dict[int, Pose] = {}
        self._trace: list[TraceRow] = []

    def take(self, number: int, tick: TickRecord) -> None:
        """Keep the tick of a number, from 0, until it is written."""
        self._unwritten.append((number, tick))

    def write(self) -> None:
        """Write the ticks that have been kept."""
        while self._unwritten:
            self._write(*self._unwritten.popleft())

    def _write(self, number: int, tick: TickRecord) -> None:
        self._inbox.write(number, tick.inbox)
        for reading in tick.readings:
            self._readings.write(reading, tick.stamp)
        self._steps.write(self._precision.take(tick.drive, tick.estimate))
        self._truth.write(tick.stamp, tick.truth.map_from_base)
        for estimate in tick.estimates:
            self._trace.append(TraceRow.of(estimate))
            if estimate.map_from_base is not None:
                self._guesses[estimate.stamp] = estimate.map_from_base

    def note(self, event: Event) -> None:
        """Record an event that the referee has noted."""
        self._notes.write(event)

    def end(self, ending: Ending) -> None:
        """Record how the run ended; the last thing that is recorded of it."""
        self.write()
        self._notes.end(ending)

    def close(self) -> None:
        """Complete the log, and write the estimates."""
        self.write()
        self._inbox.close()
        self._notes.close()
        self._steps.close()
        self._truth.close()
        self._readings.close()
        write_tum(self.path / "estimate.tum", Trajectory.from_poses(self._guesses.items()))
        write_trace(self.path / "trace.csv", self._trace)


def _readings(path: Path, scenario: Scenario, scene: Scene) -> ReadingsWriter:
    world: World = scene.world
    mounts = world.robot.mounts
    scanners = simulation_config(scenario).scanners
    metadata = {
        "scene": scenario.world.scene,
        "seed": str(scenario.seed),
        "map_sha256": scene.cloud.sha256,
        **config_metadata(LocalizerConfig()),
    }
    return ReadingsWriter(
        path,
        {each.name: mounts[each.name] for each in scanners},
        metadata,
        wheel_radius=world.robot.rolling_radius,
    )
