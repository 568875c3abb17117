"""Mutants of the robot's code, by which the fuzzer is graded; each is one small change that a programmer could make.

A mutant is applied to the running process for good, so it is applied in a process of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np

from localization.monitoring.jump_detection import Change, JumpDetector
from localization.pipeline.localizer import Localizer
from localization.pipeline.validation import ReadingValidator
from localization.relocalization.hint_search import HintSearch
from localization.relocalization.hypotheses import Hypotheses
from localization.types import (
    Candidate,
    Health,
    Inertial,
    Pose,
    Sweep,
    Twist,
    Verdict,
    WheelSpeeds,
)
from robot_sim.drive.drivetrain import Drivetrain
from robot_sim.drive.encoders import Encoders
from robot_sim.sensors.imu import InertialUnit
from robot_sim.simulation import Simulation
from teleop.joystick import VelocityRequest
from teleop.link.command_age import CommandAge, RoundTrips
from teleop.robot.clients import client_inputs, input_messages, robot_services
from teleop.robot.clients.rosbridge_adapter import RosbridgeAdapter
from teleop.robot.estimation import Estimation
from teleop.robot.inbox import DriveCommand, EStop
from teleop.robot.safety import safety
from teleop.robot.safety.arming import ArmingRules
from teleop.robot.safety.safety import Safety
from teleop.robot.safety.speed_limits import SpeedLimits
from teleop.robot.safety.stale_commands import StaleLimits
from teleop.robot.topics import estimate_messages
from teleop.robot.topics.topic_table import OUTPUTS
from teleop.rosbridge.protocol.connection import Connection

SECOND: Final = 1_000_000_000


def patch(owner: Any, name: str, value: Any) -> None:
    """Replace an attribute; tests replace this function by one that takes the change back."""
    setattr(owner, name, value)


def _wrapped(owner: Any, name: str, changed: Callable[..., Any]) -> None:
    """Replace a method by one that gets the original as its first argument."""
    original = getattr(owner, name)

    def method(*args: Any, **settings: Any) -> Any:
        return changed(original, *args, **settings)

    patch(owner, name, method)


MUTANTS: Final[dict[str, Callable[[], None]]] = {}
"""What applies each mutant, by name."""


def mutant(apply: Callable[[], None]) -> Callable[[], None]:
    """Register a function that applies the mutant of its name."""
    MUTANTS[apply.__name__] = apply
    return apply


def around(
    owner: Any, name: str, mutants: dict[str, Callable[[], None]] = MUTANTS
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Register a function that a mutant of its name has in the place of a method, which is its first argument."""

    def register(changed: Callable[..., Any]) -> Callable[..., Any]:
        mutants[changed.__name__] = partial(_wrapped, owner, name, changed)
        return changed

    return register


@around(Safety, "__init__")
def no_watchdog(original: Any, self: Safety, *args: Any) -> None:
    """A driver's last command stays in force for ever."""
    original(self, *args)
    self.config = replace(self.config, watchdog=10**15, lease=10**15)


@around(Safety, "__init__")
def slow_watchdog(original: Any, self: Safety, *args: Any) -> None:
    """The watchdog takes a second."""
    original(self, *args)
    self.config = replace(self.config, watchdog=SECOND)


@mutant
def stale_command_obeyed() -> None:
    """Commands are followed however old they are."""
    patch(StaleLimits, "refusal", lambda self, age: None)
    patch(StaleLimits, "speed_share", lambda self, age: 1.0)


@around(CommandAge, "observe")
def way_back_ignored(original: Any, self: CommandAge, arrival: int, stamp: int, trips: Any) -> Any:
    """The age of commands does not count the way back to their driver, nor any other round trip."""
    return original(self, arrival, stamp, RoundTrips(last=0))


@around(Safety, "request")
def lease_race(original: Any, self: Safety, command: DriveCommand, now: int) -> Any:
    """A second driver's command is followed as well."""
    holder = self._controller
    if holder and command.client != holder and command.request.enabled:
        self._controller = command.client
        answer = original(self, command, now)
        self._controller = holder
        return answer
    return original(self, command, now)


@around(SpeedLimits, "limited")
def limits_not_applied(_: Any, self: SpeedLimits, twist: Twist) -> Any:
    """The speed limits are forgotten, by what arbitrates and by the drive."""
    return twist


@around(InertialUnit, "read")
def gyro_sign(original: Any, self: InertialUnit, *args: Any) -> Inertial:
    """The gyro turns the wrong way round."""
    reading: Inertial = original(self, *args)
    return replace(reading, angular_velocity=-reading.angular_velocity)


@around(InertialUnit, "read")
def gyro_scale(original: Any, self: InertialUnit, *args: Any) -> Inertial:
    """The gyro reports 15 % too much."""
    reading: Inertial = original(self, *args)
    return replace(reading, angular_velocity=1.15 * reading.angular_velocity)


def _changed_estimates(change: Callable[[Any], Any]) -> None:
    def take(original: Any, self: Estimation, tick: Any) -> Any:
        record = original(self, tick)
        return replace(record, estimates=tuple(change(e) for e in record.estimates))

    _wrapped(Estimation, "take", take)


@mutant
def covariance_halved() -> None:
    """The robot claims to be twice as certain as it is."""
    _changed_estimates(lambda e: replace(e, covariance=0.5 * e.covariance))


@mutant
def covariance_tiny() -> None:
    """The robot claims ten times smaller errors."""
    _changed_estimates(lambda e: replace(e, covariance=0.01 * e.covariance))


@mutant
def never_lost() -> None:
    """Whatever happens, the robot says that it knows where it is."""

    def sure(estimate: Any) -> Any:
        if estimate.map_from_base is None:
            return estimate
        return replace(estimate, health=Health.TRACKING)

    _changed_estimates(sure)


@mutant
def hint_never_answered() -> None:
    """Hints have their effect, and their answers are lost."""
    _changed_estimates(lambda e: replace(e, verdict=None))


@mutant
def hint_unverified() -> None:
    """A hint is believed without a look at the scan."""

    def judged(original: Any, self: HintSearch, task: Any, candidates: Any, *rest: Any) -> Any:
        return Verdict.ACCEPTED, "the operator says so"

    def advance(original: Any, self: HintSearch, *args: Any, **settings: Any) -> Any:
        state, result = original(self, *args, **settings)
        if result is not None and result.hint is not None:
            place = Candidate(result.hint.map_from_base, 1.0)
            result = replace(result, candidates=(place, *result.candidates))
        return state, result

    _wrapped(HintSearch, "_judged", judged)
    _wrapped(HintSearch, "advance", advance)


@around(Localizer, "undo")
def undo_forgets(_: Any, self: Localizer) -> Any:
    """An undo does nothing, and says that it did."""
    return self._last


@around(Safety, "request")
def estop_released_by_neutral(original: Any, self: Safety, command: DriveCommand, now: int) -> Any:
    """A neutral stick releases the e-stop."""
    if command.request.neutral:
        self._estop = None
    return original(self, command, now)


@around(Safety, "stop")
def estop_ignored_while_driving(original: Any, self: Safety, order: EStop) -> None:
    """The e-stop works on a robot that stands."""
    if not self._armed:
        original(self, order)


@around(Safety, "disconnected")
def disconnect_ignored(_: Any, self: Safety, client: str) -> None:
    """That a driver leaves goes unnoticed."""


@around(ArmingRules, "refusal")
def no_neutral(_: Any, self: ArmingRules, command: DriveCommand) -> None:
    """A stick drives at once after an interruption."""


@mutant
def deadman_ignored() -> None:
    """The stick drives without the deadman."""

    def joy(original: Any, *args: Any) -> DriveCommand:
        command: DriveCommand = original(*args)
        request = VelocityRequest(command.request.twist, enabled=True)
        return replace(command, request=request)

    _wrapped(client_inputs, "joy_command", joy)
    _wrapped(input_messages, "joy_command", joy)


@around(Safety, "_give_lease")
def take_over_stays_armed(original: Any, self: Safety, client: str, reason: str) -> None:
    """Who takes the lease drives at once, with the stick as it is."""
    original(self, client, reason)
    self._armed = True


@around(Simulation, "command")
def turn_sign(original: Any, self: Simulation, twist: Twist) -> None:
    """The drive turns the wrong way."""
    original(self, Twist(twist.linear, -twist.angular))


@around(Drivetrain, "__init__")
def weak_brakes(original: Any, self: Drivetrain, config: Any, robot: Any) -> None:
    """The robot brakes at a tenth of its deceleration."""
    original(self, replace(config, braking=0.1, turn_braking=0.3), robot)


@around(Encoders, "read")
def noise_without_seed(original: Any, self: Encoders, *args: Any) -> WheelSpeeds:
    """Some noise is not drawn by the seed."""
    reading: WheelSpeeds = original(self, *args)
    drift = 1e-6 * float(np.random.default_rng().standard_normal())
    return replace(reading, left=reading.left + drift)


@mutant
def sound_scans_refused() -> None:
    """Every fiftieth reading is refused."""
    count = 0

    def refusal(original: Any, self: ReadingValidator, *args: Any) -> Any:
        nonlocal count
        count += 1
        return "refused: not plausible" if count % 50 == 0 else original(self, *args)

    _wrapped(ReadingValidator, "refusal", refusal)


@around(Localizer, "__init__")
def scanner_askew(
    original: Any, self: Localizer, world: Any, mounts: Any, *args: Any, **kw: Any
) -> None:
    """The localiser believes the scanners to be mounted 4 degrees askew."""
    turn = Pose.from_euler(np.zeros(3), yaw=math.radians(4.0))
    original(self, world, {n: m @ turn for n, m in mounts.items()}, *args, **kw)


@mutant
def old_pose_published() -> None:
    """The published pose is that of the message before."""
    before: list[Any] = []
    topic = next(t for t in OUTPUTS if t.name == "/amcl_pose")

    def build(tick: Any) -> Any:
        before.append(topic_build(tick))
        return before[-2] if len(before) > 1 else before[-1]

    topic_build = topic.build
    object.__setattr__(topic, "build", build)


@around(Hypotheses, "compared")
def any_place_believed(
    original: Any, self: Hypotheses, sweep: Sweep, odom_from_base: Pose, *rest: Any, **more: Any
) -> tuple[Hypotheses, Candidate | None]:
    """A search believes one of its places, whatever speaks for others."""
    left, _ = original(self, sweep, odom_from_base, *rest, **more)
    return left, left.candidates(odom_from_base)[-1] if left.places else None


@around(JumpDetector, "compared")
def jumps_unnoticed(
    original: Any, self: JumpDetector, sweep: Sweep, odom_from_base: Pose
) -> tuple[JumpDetector, Change | None]:
    """That what is seen changes at once, all or a part of it, is not noticed."""
    detector, _ = original(self, sweep, odom_from_base)
    return detector, None


@mutant
def late_estop() -> None:
    """The e-stop takes effect a second late."""
    waiting: list[tuple[int, EStop]] = []

    def stop(original: Any, self: Safety, order: EStop) -> None:
        waiting.append((self._arrival + SECOND, order))

    def command(original: Any, self: Safety, now: int) -> Any:
        for due, order in list(waiting):
            if now >= due:
                waiting.remove((due, order))
                stop_at_once(self, order)
        return original(self, now)

    stop_at_once = Safety.stop
    _wrapped(Safety, "stop", stop)
    _wrapped(Safety, "command", command)


@around(estimate_messages, "_transform")
def transform_not_inverted(original: Any, stamp: int, parent: str, child: str, pose: Pose) -> Any:
    """The transform from ``map`` to ``odom`` is the one from ``odom`` to ``map``."""
    return original(stamp, parent, child, pose.inverse() if parent == "map" else pose)


@mutant
def covariance_about_own_axes() -> None:
    """The published covariance has rotations about the robot's axes, not the map's."""
    patch(estimate_messages, "ros_covariance", lambda e: e.covariance.ravel())


@around(estimate_messages, "odometry")
def odometry_in_map(original: Any, stamp: int, frame: str, *rest: Any) -> Any:
    """The odometry says that it is in ``map``."""
    return original(stamp, "map", *rest)


@around(estimate_messages, "odometry")
def odometry_stamp_late(original: Any, stamp: int, *rest: Any) -> Any:
    """Each tenth message of odometry bears the time of the tick before."""
    return original(stamp - SECOND // 50 * (stamp % (SECOND * 2 // 5) == 0), *rest)


def _changed_on_the_way(change: Callable[[Any], Any]) -> None:
    """Change what is published of an estimate, and nothing that the robot itself makes of it."""

    def estimated(original: Any, self: RosbridgeAdapter, tick: Any) -> None:
        original(self, replace(tick, estimates=tuple(change(e) for e in tick.estimates)))

    _wrapped(RosbridgeAdapter, "estimated", estimated)


@mutant
def cloud_distances_negated() -> None:
    """Points of the published sweep that lie before a wall are shown behind it."""

    def change(e: Any) -> Any:
        if e.match is None:
            return e
        return replace(e, match=replace(e.match, distances=-e.match.distances))

    _changed_on_the_way(change)


@mutant
def old_sweep_published() -> None:
    """The sweep before is published at the present pose."""
    before: list[Sweep] = []

    def change(e: Any) -> Any:
        if e.sweep is None:
            return e
        before.append(e.sweep)
        same = len(before) > 1 and len(before[-2].points) == len(e.sweep.points)
        return replace(e, sweep=before[-2]) if same else e

    _changed_on_the_way(change)


@around(Connection, "require")
def viewers_may_publish(original: Any, self: Connection, act: str, name: str) -> None:
    """Nobody asks whether a client may publish."""
    if act != "publish":
        original(self, act, name)


@around(Connection, "refusal")
def viewers_may_call(original: Any, self: Connection, act: str, name: str) -> Any:
    """Nobody asks whether a client may call a service."""
    return None if act == "call" else original(self, act, name)


@mutant
def estop_released_by_all() -> None:
    """An e-stop is released by all who ask for it."""
    patch(robot_services, "reset_rejection", lambda latched, order: None)
    patch(safety, "reset_rejection", lambda latched, order: None)


@around(Safety, "__init__")
def lease_never_ends(original: Any, self: Safety, *args: Any) -> None:
    """A driver that has fallen silent keeps the robot."""
    original(self, *args)
    self.config = replace(self.config, lease=10**15)


@around(SpeedLimits, "limited")
def turns_swapped_backwards(original: Any, self: SpeedLimits, twist: Twist) -> Twist:
    """Driven backwards the robot turns as a car does, the wrong way round for a twist."""
    found: Twist = original(self, twist)
    return Twist(found.linear, -found.angular) if found.linear[0] < 0.0 else found
