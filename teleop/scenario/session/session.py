"""A run under way: robot, server, faults and referee, ticked by what keeps its time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from typing import Final

from robot_sim import PhysicsError, Simulation
from teleop.link.timeline import LinkTimeline
from teleop.robot.arm.arm_fit import ArmFit
from teleop.robot.assembly import RobotParts, build_stepped_robot
from teleop.robot.drive import Stages
from teleop.robot.gateway import Camera
from teleop.robot.inbox import InboxMessage, PoseHint
from teleop.robot.safety.control_state import SafetyConfig
from teleop.robot.safety.stale_commands import StaleLimits
from teleop.robot.serving.camera_choice import without_camera
from teleop.robot.serving.serve_config import ServeConfig
from teleop.robot.stepped_robot import TickObserver
from teleop.robot.tick_record import TickRecord
from teleop.robot.topics.topic_table import GROUND_TRUTH
from teleop.rosbridge.auth.authenticator import Authenticator
from teleop.scenario.files.operator_settings import Client, Station
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.referee.outcome import EventKind
from teleop.scenario.referee.referee import Referee
from teleop.scenario.referee.rules.arm_facts import ArmFacts
from teleop.scenario.referee.rules.rule_book import RuleBook
from teleop.scenario.session.fault_schedule import FaultSchedule
from teleop.scenario.session.operator_tokens import tokens_of
from teleop.scenario.session.places import given_pose, goal_points, start_pose
from teleop.scenario.session.referee_notes import Note
from teleop.scenario.session.run_folder import RunFolder
from teleop.scenario.session.scenario_state import StatePublisher
from teleop.scenario.session.scene import Scene, simulation_config
from teleop.scenario.session.second_arm import SecondArm

SECOND: Final = 1_000_000_000

Inboxes = Callable[[int], Sequence[InboxMessage]]
"""Returns the recorded messages of the tick of a number."""


class Session:
    """One run of a scenario; the same inboxes give the same bits, whatever the pace."""

    def __init__(
        self,
        scenario: Scenario,
        scene: Scene,
        *,
        link: LinkTimeline | None = None,
        authenticator: Authenticator | None = None,
        by_clock: bool = False,
        port: int = 0,
        recorded: Inboxes | None = None,
        notes: Sequence[Note] = (),
        observers: Sequence[TickObserver] = (),
        stage: Stages = lambda _: nullcontext(),
        camera: str | None = None,
        without_camera: Callable[[Exception], None] = without_camera,
    ) -> None:
        """Put the robot at its start.

        Args:
            scenario: The scenario.
            scene: Its world and map.
            link: Emulates the links of the clients.
            authenticator: Verifies tokens; without one everybody may do everything.
            by_clock: Whether it is ticked by the clock, for clients with sockets; they have limits of rates and
                timeouts then, as those of a robot have.
            port: Port of the server, if it is started.
            recorded: Messages of each tick, of which those of faults are part; without them clients are listened to.
            notes: What was noted of clients as the messages were recorded, in order. Rules are not judged anew then:
                they need the frames that clients sent.
            observers: Called with the record of each tick.
            stage: Measures the stages of a tick: ``simulation``, ``localiser`` and ``referee``; the rest is the wire.
            camera: Name of the camera that the robot carries, drawn in its ticks; None for none.
            without_camera: Called with the reason if nothing can be drawn; the robot then has no camera.

        Raises:
            CameraError: If there is no camera of that name.
        """
        self.scenario, self.scene = scenario, scene
        self.tokens = tokens_of(scenario)
        """Tokens of the operators of the library, if they have roles."""

        world = scene.world
        parts = RobotParts(
            world,
            scenario.seed,
            simulation_config(scenario),
            start_pose(world, scenario.start),
            _safety_config(scenario),
            arm_speed=scenario.world.arm_speed,
            guard=scenario.world.guard,
        )
        self.stepped = build_stepped_robot(
            parts,
            scene.cloud,
            scene.prepared,
            ServeConfig(port=port, lockstep=not by_clock, camera=camera),
            video=False,
            authenticator=authenticator or self.tokens.authenticator,
            link=link,
            hidden=_hidden(scenario),
            stage=stage,
            without_camera=without_camera,
        )
        self.adapter, self.server = self.stepped.adapter, self.stepped.gateway.server
        protocol, simulation = self.server.protocol, self.simulation
        x, y = simulation.truth().map_from_base.position[:2].tolist()
        fit = ArmFit.of(world)
        board = fit is not None and scenario.world.board is not None
        self.second_arm = SecondArm(scenario, fit.table) if fit is not None and board else None
        """A second arm that follows the robot's, if the scenario has one."""

        self.referee = Referee(
            goal_points(world, scenario),
            scenario.limits,
            (x, y),
            fit,
            scenario.mission,
        )
        self.faults = FaultSchedule(
            scenario, simulation, lambda text: self.referee.note(EventKind.FAULT, text)
        )
        self.rules: RuleBook | None = None
        """The rules that hold in every run, if they are judged."""

        if scenario.limits.rules and recorded is None:
            drive = simulation.config.drive
            self.rules = RuleBook(
                scenario,
                scene.cloud,
                drive,
                protocol.observers,
                lambda: simulation.stamp,
                None if fit is None else ArmFacts(simulation, fit, self.second_arm),
            )
        self.folder: RunFolder | None = None
        """Where the run is recorded; None for a run of which only the outcome is kept."""

        self.ending: str | None = None
        """Why the run is over; None while it goes on."""

        self.cut_short = False
        """Whether it ended before it was decided, so that it cannot have passed."""

        self._publisher = StatePublisher(protocol, scenario, self.referee)
        self._recorded, self._notes = recorded, deque(notes)
        self.ticks = 0
        """Number of ticks so far."""

        self.records_later = False
        """Whether ``record`` is called by who ticks it, when nobody waits."""

        self._stage = stage
        self.stepped.observers = (*observers, self._observe)
        self.stepped.inbox = self._inbox

    @property
    def simulation(self) -> Simulation:
        """The simulated robot in its world."""
        return self.stepped.robot.simulation

    @property
    def camera(self) -> Camera | None:
        """The robot's camera, if it has one; freed by who ends the session."""
        return self.stepped.gateway.camera

    @property
    def stamp(self) -> int:
        """Robot time [ns]."""
        return self.stepped.stamp

    @property
    def time_limit(self) -> int:
        """Time at which the run ends at the latest [ns]."""
        return round(self.scenario.mission.time_limit * SECOND)

    def tick(self) -> TickRecord | None:
        """Advance by one tick, unless the run is over."""
        if self.ending is not None:
            return None
        try:
            return self.stepped.tick()
        except PhysicsError as error:
            self.end(f"the physics became unstable: {error}", cut_short=True)
            return None

    @property
    def share(self) -> float:
        """Share of the run that is over, in [0, 1]: of its goals or of its time, whichever is more."""
        goals = len(self.referee.goals)
        return max(self.stamp / self.time_limit, self.referee.reached / goals if goals else 0.0)

    def record(self) -> None:
        """Write what the folder has taken."""
        if self.folder is not None:
            with self._stage("log"):
                self.folder.write()

    def note(self, kind: EventKind, text: str) -> None:
        """Have the referee note an event of the present, and record it."""
        self.referee.note(kind, text)
        if self.folder is not None:
            self.folder.note(self.referee.events[-1])

    def end(self, why: str, *, cut_short: bool = False) -> None:
        """End the run for a reason, if it has not ended; one that is cut short cannot have passed."""
        self._repeat_notes()
        if self.ending is None:
            self.ending, self.cut_short = why, cut_short
            self._publisher.publish(self.stamp, self.ending)

    def _repeat_notes(self) -> None:
        """Note again what was noted of clients by now."""
        while self._notes and self._notes[0].stamp <= self.stamp:
            note = self._notes.popleft()
            self.note(note.kind, note.text)

    def _inbox(self) -> Sequence[InboxMessage]:
        """Apply the faults that are due, and return the messages of the next tick."""
        self._repeat_notes()
        by_faults = self.faults.apply(self.stamp)
        if self._recorded is not None:
            return self._recorded(self.ticks)
        known = self._given() if self.ticks == 0 else []
        return [*known, *by_faults, *self.adapter.wishes.take()]

    def _given(self) -> list[InboxMessage]:
        """Return what the robot knows of its start."""
        hint = given_pose(self.scenario, self.simulation.truth().map_from_base)
        return [] if hint is None else [PoseHint("", hint)]

    def _observe(self, tick: TickRecord) -> None:
        if self.second_arm is not None:
            self.second_arm.take(tick)
            self.referee.mirror_error = self.second_arm.error
        with self._stage("referee"):
            self.referee.take(tick)
        if self.rules is not None:
            for broken in self.rules.take(tick):
                self.note(EventKind.RULE, f"rule {broken.rule} is broken: {broken.how}")
        if self.folder is not None:
            self.folder.take(self.ticks, tick)
            if not self.records_later:
                self.record()
        self.ticks += 1
        if self.referee.all_reached:
            self.end("all goals are reached")
        elif tick.stamp >= self.time_limit:
            due = self.referee.goals and self.referee.limits.goals
            self.end("time is up" if due else "the time of the run is over")
        else:
            self._publisher.due(tick.stamp)


def _hidden(scenario: Scenario) -> frozenset[str]:
    """Return the topics that clients do not get: those of ground truth, unless they are asked for."""
    operator = scenario.operator
    shown = isinstance(operator, Station) or (isinstance(operator, Client) and operator.truth)
    return frozenset() if shown else GROUND_TRUTH


def _safety_config(scenario: Scenario) -> SafetyConfig:
    """Return the timeouts of the command path, and its limits on old commands unless the scenario has none."""
    return SafetyConfig() if scenario.world.stale_limits else SafetyConfig(stale=StaleLimits(0, 0))
