"""Mutants of the robot's code, by which the fuzzer is graded; each is one small change that a programmer could make.

A mutant is applied to the running process for good, so it is applied in a process of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
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


def _wrapped(owner: Any, name: str, around: Callable[..., Any]) -> None:
    """Replace a method by one that gets the original as its first argument."""
    original = getattr(owner, name)

    def method(*args: Any, **settings: Any) -> Any:
        return around(original, *args, **settings)

    patch(owner, name, method)


def no_watchdog() -> None:
    """A driver's last command stays in force for ever."""

    def begin(original: Any, self: Safety, *args: Any) -> None:
        original(self, *args)
        self.config = replace(self.config, watchdog=10**15, lease=10**15)

    _wrapped(Safety, "__init__", begin)


def slow_watchdog() -> None:
    """The watchdog takes a second."""

    def begin(original: Any, self: Safety, *args: Any) -> None:
        original(self, *args)
        self.config = replace(self.config, watchdog=SECOND)

    _wrapped(Safety, "__init__", begin)


def stale_command_obeyed() -> None:
    """Commands are followed however old they are."""
    patch(StaleLimits, "refusal", lambda self, age: None)
    patch(StaleLimits, "speed_share", lambda self, age: 1.0)


def way_back_ignored() -> None:
    """The age of commands does not count the way back to their driver, nor any other round trip."""

    def observe(original: Any, self: CommandAge, arrival: int, stamp: int, trips: Any) -> Any:
        return original(self, arrival, stamp, RoundTrips(last=0))

    _wrapped(CommandAge, "observe", observe)


def lease_race() -> None:
    """A second driver's command is followed as well."""

    def request(original: Any, self: Safety, command: DriveCommand, now: int) -> Any:
        holder = self._controller
        if holder and command.client != holder and command.request.enabled:
            self._controller = command.client
            answer = original(self, command, now)
            self._controller = holder
            return answer
        return original(self, command, now)

    _wrapped(Safety, "request", request)


def limits_not_applied() -> None:
    """The speed limits are forgotten, by what arbitrates and by the drive."""
    patch(SpeedLimits, "limited", lambda self, twist: twist)


def gyro_sign() -> None:
    """The gyro turns the wrong way round."""

    def read(original: Any, self: InertialUnit, *args: Any) -> Inertial:
        reading: Inertial = original(self, *args)
        return replace(reading, angular_velocity=-reading.angular_velocity)

    _wrapped(InertialUnit, "read", read)


def gyro_scale() -> None:
    """The gyro reports 15 % too much."""

    def read(original: Any, self: InertialUnit, *args: Any) -> Inertial:
        reading: Inertial = original(self, *args)
        return replace(reading, angular_velocity=1.15 * reading.angular_velocity)

    _wrapped(InertialUnit, "read", read)


def _changed_estimates(change: Callable[[Any], Any]) -> None:
    def take(original: Any, self: Estimation, tick: Any) -> Any:
        record = original(self, tick)
        return replace(record, estimates=tuple(change(e) for e in record.estimates))

    _wrapped(Estimation, "take", take)


def covariance_halved() -> None:
    """The robot claims to be twice as certain as it is."""
    _changed_estimates(lambda e: replace(e, covariance=0.5 * e.covariance))


def covariance_tiny() -> None:
    """The robot claims ten times smaller errors."""
    _changed_estimates(lambda e: replace(e, covariance=0.01 * e.covariance))


def never_lost() -> None:
    """Whatever happens, the robot says that it knows where it is."""

    def sure(estimate: Any) -> Any:
        if estimate.map_from_base is None:
            return estimate
        return replace(estimate, health=Health.TRACKING)

    _changed_estimates(sure)


def hint_never_answered() -> None:
    """Hints have their effect, and their answers are lost."""
    _changed_estimates(lambda e: replace(e, verdict=None))


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


def undo_forgets() -> None:
    """An undo does nothing, and says that it did."""
    patch(Localizer, "undo", lambda self: self._last)


def estop_released_by_neutral() -> None:
    """A neutral stick releases the e-stop."""

    def request(original: Any, self: Safety, command: DriveCommand, now: int) -> Any:
        if command.request.neutral:
            self._estop = None
        return original(self, command, now)

    _wrapped(Safety, "request", request)


def estop_ignored_while_driving() -> None:
    """The e-stop works on a robot that stands."""

    def stop(original: Any, self: Safety, order: EStop) -> None:
        if not self._armed:
            original(self, order)

    _wrapped(Safety, "stop", stop)


def disconnect_ignored() -> None:
    """That a driver leaves goes unnoticed."""
    patch(Safety, "disconnected", lambda self, client: None)


def no_neutral() -> None:
    """A stick drives at once after an interruption."""
    patch(ArmingRules, "refusal", lambda self, command: None)


def deadman_ignored() -> None:
    """The stick drives without the deadman."""

    def joy(original: Any, *args: Any) -> DriveCommand:
        command: DriveCommand = original(*args)
        request = VelocityRequest(command.request.twist, enabled=True)
        return replace(command, request=request)

    _wrapped(client_inputs, "joy_command", joy)
    _wrapped(input_messages, "joy_command", joy)


def take_over_stays_armed() -> None:
    """Who takes the lease drives at once, with the stick as it is."""

    def give(original: Any, self: Safety, client: str, reason: str) -> None:
        original(self, client, reason)
        self._armed = True

    _wrapped(Safety, "_give_lease", give)


def turn_sign() -> None:
    """The drive turns the wrong way."""

    def command(original: Any, self: Simulation, twist: Twist) -> None:
        original(self, Twist(twist.linear, -twist.angular))

    _wrapped(Simulation, "command", command)


def weak_brakes() -> None:
    """The robot brakes at a tenth of its deceleration."""

    def begin(original: Any, self: Drivetrain, config: Any, robot: Any) -> None:
        original(self, replace(config, braking=0.1, turn_braking=0.3), robot)

    _wrapped(Drivetrain, "__init__", begin)


def noise_without_seed() -> None:
    """Some noise is not drawn by the seed."""

    def read(original: Any, self: Encoders, *args: Any) -> WheelSpeeds:
        reading: WheelSpeeds = original(self, *args)
        drift = 1e-6 * float(np.random.default_rng().standard_normal())
        return replace(reading, left=reading.left + drift)

    _wrapped(Encoders, "read", read)


def sound_scans_refused() -> None:
    """Every fiftieth reading is refused."""
    count = 0

    def refusal(original: Any, self: ReadingValidator, *args: Any) -> Any:
        nonlocal count
        count += 1
        return "refused: not plausible" if count % 50 == 0 else original(self, *args)

    _wrapped(ReadingValidator, "refusal", refusal)


def scanner_askew() -> None:
    """The localiser believes the scanners to be mounted 4 degrees askew."""

    def begin(
        original: Any, self: Localizer, world: Any, mounts: Any, *args: Any, **kw: Any
    ) -> None:
        turn = Pose.from_euler(np.zeros(3), yaw=math.radians(4.0))
        original(self, world, {n: m @ turn for n, m in mounts.items()}, *args, **kw)

    _wrapped(Localizer, "__init__", begin)


def old_pose_published() -> None:
    """The published pose is that of the message before."""
    before: list[Any] = []
    topic = next(t for t in OUTPUTS if t.name == "/amcl_pose")

    def build(tick: Any) -> Any:
        before.append(topic_build(tick))
        return before[-2] if len(before) > 1 else before[-1]

    topic_build = topic.build
    object.__setattr__(topic, "build", build)


def first_place_believed() -> None:
    """A search believes its first place, whatever speaks for others."""
    patch(
        Hypotheses,
        "decided",
        lambda self, search, config: Candidate(self.places[-1].map_from_base, 1.0),
    )


def jumps_unnoticed() -> None:
    """That what is seen changes at once, all or a part of it, is not noticed."""

    def compared(
        original: Any, self: JumpDetector, sweep: Sweep, odom_from_base: Pose
    ) -> tuple[JumpDetector, Change]:
        detector, change = original(self, sweep, odom_from_base)
        return detector, change if change is Change.UNKNOWN else Change.NONE

    _wrapped(JumpDetector, "compared", compared)


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


def transform_not_inverted() -> None:
    """The transform from ``map`` to ``odom`` is the one from ``odom`` to ``map``."""

    def transform(original: Any, stamp: int, parent: str, child: str, pose: Pose) -> Any:
        return original(stamp, parent, child, pose.inverse() if parent == "map" else pose)

    _wrapped(estimate_messages, "_transform", transform)


def covariance_about_own_axes() -> None:
    """The published covariance has rotations about the robot's axes, not the map's."""
    patch(estimate_messages, "ros_covariance", lambda e: e.covariance.ravel())


def odometry_in_map() -> None:
    """The odometry says that it is in ``map``."""

    def odometry(original: Any, stamp: int, frame: str, *rest: Any) -> Any:
        return original(stamp, "map", *rest)

    _wrapped(estimate_messages, "odometry", odometry)


def odometry_stamp_late() -> None:
    """Each tenth message of odometry bears the time of the tick before."""

    def odometry(original: Any, stamp: int, *rest: Any) -> Any:
        return original(stamp - SECOND // 50 * (stamp % (SECOND * 2 // 5) == 0), *rest)

    _wrapped(estimate_messages, "odometry", odometry)


def _changed_on_the_way(change: Callable[[Any], Any]) -> None:
    """Change what is published of an estimate, and nothing that the robot itself makes of it."""

    def estimated(original: Any, self: RosbridgeAdapter, tick: Any) -> None:
        original(self, replace(tick, estimates=tuple(change(e) for e in tick.estimates)))

    _wrapped(RosbridgeAdapter, "estimated", estimated)


def cloud_distances_negated() -> None:
    """Points of the published sweep that lie before a wall are shown behind it."""

    def change(e: Any) -> Any:
        if e.match is None:
            return e
        return replace(e, match=replace(e.match, distances=-e.match.distances))

    _changed_on_the_way(change)


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


def viewers_may_publish() -> None:
    """Nobody asks whether a client may publish."""

    def require(original: Any, self: Connection, act: str, name: str) -> None:
        if act != "publish":
            original(self, act, name)

    _wrapped(Connection, "require", require)


def viewers_may_call() -> None:
    """Nobody asks whether a client may call a service."""

    def refusal(original: Any, self: Connection, act: str, name: str) -> Any:
        return None if act == "call" else original(self, act, name)

    _wrapped(Connection, "refusal", refusal)


def estop_released_by_all() -> None:
    """An e-stop is released by all who ask for it."""
    patch(robot_services, "reset_rejection", lambda latched, order: None)
    patch(safety, "reset_rejection", lambda latched, order: None)


def lease_never_ends() -> None:
    """A driver that has fallen silent keeps the robot."""

    def begin(original: Any, self: Safety, *args: Any) -> None:
        original(self, *args)
        self.config = replace(self.config, lease=10**15)

    _wrapped(Safety, "__init__", begin)


def turns_swapped_backwards() -> None:
    """Driven backwards the robot turns as a car does, the wrong way round for a twist."""

    def limited(original: Any, self: SpeedLimits, twist: Twist) -> Twist:
        found: Twist = original(self, twist)
        return Twist(found.linear, -found.angular) if found.linear[0] < 0.0 else found

    _wrapped(SpeedLimits, "limited", limited)


MUTANTS: Final[dict[str, Callable[[], None]]] = {
    mutant.__name__: mutant
    for mutant in (
        no_watchdog,
        slow_watchdog,
        stale_command_obeyed,
        lease_race,
        limits_not_applied,
        gyro_sign,
        gyro_scale,
        covariance_halved,
        covariance_tiny,
        never_lost,
        hint_never_answered,
        hint_unverified,
        undo_forgets,
        estop_released_by_neutral,
        estop_ignored_while_driving,
        disconnect_ignored,
        no_neutral,
        deadman_ignored,
        take_over_stays_armed,
        turn_sign,
        weak_brakes,
        noise_without_seed,
        sound_scans_refused,
        scanner_askew,
        old_pose_published,
        first_place_believed,
        jumps_unnoticed,
        late_estop,
        transform_not_inverted,
        covariance_about_own_axes,
        odometry_in_map,
        odometry_stamp_late,
        cloud_distances_negated,
        old_sweep_published,
        viewers_may_publish,
        viewers_may_call,
        estop_released_by_all,
        lease_never_ends,
        turns_swapped_backwards,
        way_back_ignored,
    )
}
"""All mutants by name."""
