"""The topic ``/scenario/state``: how a run stands, for who drives and who watches."""

from __future__ import annotations

from typing import Final

from localization.logs.ros_stamps import stamp_to_dict
from localization.types import SECOND
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.scenario.files.scenario import Scenario
from teleop.scenario.referee.referee import Referee

TOPIC: Final = "/scenario/state"
TYPE: Final = "farsteer_msgs/msg/ScenarioState"
_PERIOD: Final = SECOND // 5
"""Time between two messages [ns]."""


class StatePublisher:
    """Publishes how a run stands: five times a second, and as it ends."""

    def __init__(self, protocol: Protocol, scenario: Scenario, referee: Referee) -> None:
        """Advertise the topic."""
        self._topics, self._scenario, self._referee = protocol.topics, scenario, referee
        self._topics.advertise(TOPIC, TYPE, latch=True)
        self.publish(0, None)

    def due(self, stamp: int) -> None:
        """Publish if it is time to."""
        if stamp % _PERIOD == 0:
            self.publish(stamp, None)

    def publish(self, stamp: int, ending: str | None) -> None:
        """Publish at a robot time [ns]; with the reason, if the run is over."""
        referee = self._referee
        left = self._scenario.mission.time_limit - stamp / SECOND
        following = referee.goals[referee.reached :]
        goal = following[0] if following else None
        message = {
            "stamp": stamp_to_dict(stamp),
            "scenario": self._scenario.name,
            "phase": "running" if ending is None else "over",
            "ending": ending or "",
            "goals": len(referee.goals),
            "goals_reached": referee.reached,
            "next_goal": goal.name if goal else "",
            "next_x": goal.x if goal else 0.0,
            "next_y": goal.y if goal else 0.0,
            "within": goal.within if goal else 0.0,
            "time_left": max(0.0, left),
            "contacts": referee.contacts,
            "violations": referee.violations,
        }
        self._topics.publish(TOPIC, message, stamp)
