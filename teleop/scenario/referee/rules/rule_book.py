"""All rules, applied to one run."""

from __future__ import annotations

from collections.abc import Callable

from localization.maps.cloud import Cloud
from robot_sim import DriveConfig
from teleop.robot.tick_record import TickRecord
from teleop.rosbridge.protocol.observers import Observers
from teleop.scenario.files.scenario import NO_SCANNERS, Scenario
from teleop.scenario.referee.rules.answers import HintsAreAnswered
from teleop.scenario.referee.rules.arm_authority import (
    ArmHasASource,
    ArmHeedsTheEStop,
    ArmIsMirrored,
    ArmSlowsTheVehicle,
)
from teleop.scenario.referee.rules.arm_facts import ArmFacts
from teleop.scenario.referee.rules.arm_motion import (
    ArmFollowsTheHand,
    ArmKeepsClear,
    ArmKeepsItsBounds,
)
from teleop.scenario.referee.rules.authority import EStopStays, NeutralFirst, OneDriver
from teleop.scenario.referee.rules.command_in_force import (
    CommandHasASource,
    CommandIsLimited,
    CommandIsNew,
)
from teleop.scenario.referee.rules.estimate import (
    ErrorIsBounded,
    NumbersAreSound,
    OdometryIsSmooth,
    ReadingsAreTaken,
)
from teleop.scenario.referee.rules.motion import ComesToRest, MovesAsTold
from teleop.scenario.referee.rules.published import PublishedInTime, PublishedIsBelieved
from teleop.scenario.referee.rules.published_cloud import CloudIsBelieved
from teleop.scenario.referee.rules.published_messages import PublishedMessages
from teleop.scenario.referee.rules.rights import FreeRobotIsHad, ViewersWatch
from teleop.scenario.referee.rules.rule import Broken, Rule, RunFacts
from teleop.scenario.referee.rules.undo import UndoUndoes
from teleop.scenario.referee.rules.wire_facts import WireFacts

RULES: tuple[type[Rule], ...] = (
    CommandHasASource,
    CommandIsLimited,
    CommandIsNew,
    OneDriver,
    NeutralFirst,
    EStopStays,
    ComesToRest,
    MovesAsTold,
    NumbersAreSound,
    ReadingsAreTaken,
    ErrorIsBounded,
    OdometryIsSmooth,
    UndoUndoes,
    HintsAreAnswered,
    PublishedIsBelieved,
    PublishedInTime,
    CloudIsBelieved,
    ViewersWatch,
    FreeRobotIsHad,
    ArmHasASource,
    ArmHeedsTheEStop,
    ArmKeepsItsBounds,
    ArmFollowsTheHand,
    ArmKeepsClear,
    ArmSlowsTheVehicle,
    ArmIsMirrored,
)
"""All rules."""


class RuleBook:
    """Applies the rules to a run; owns which were broken, each once."""

    def __init__(
        self,
        scenario: Scenario,
        cloud: Cloud,
        drive: DriveConfig,
        observers: Observers,
        clock: Callable[[], int],
        arm: ArmFacts | None = None,
    ) -> None:
        """Begin a run.

        Args:
            scenario: What is run.
            cloud: The robot's map.
            drive: Limits of the simulated drive.
            observers: Observers of the clients' connections, to which it is added.
            clock: Returns the robot's time [ns].
            arm: The arm, if the robot carries one.
        """
        self.broken: list[Broken] = []
        """Rules that have been broken, in order of time."""

        self.wire, self.published = WireFacts(clock), PublishedMessages()
        observers.add(self.wire)
        observers.add(self.published)
        facts = RunFacts(
            scenario,
            self.wire,
            cloud,
            drive.max_speed,
            drive.max_turn,
            min(drive.braking, drive.acceleration),
            self.published,
            arm,
        )
        # Without a scanner no hint is judged.
        blind = scenario.world.scanner == NO_SCANNERS
        judged = [rule for rule in RULES if not (blind and rule is HintsAreAnswered)]
        self._rules: list[Rule] = [rule(facts) for rule in judged]

    def take(self, tick: TickRecord) -> list[Broken]:
        """Apply the rules to one tick; return those that are broken by it, which are not applied again."""
        before = len(self.broken)
        for rule in list(self._rules):
            how = rule.take(tick)
            if how is not None:
                self.broken.append(Broken(rule.name, tick.stamp, how))
                self._rules.remove(rule)
        self.published.clear()
        return self.broken[before:]
