"""Which run of the robot the messages belong to: a robot that begins anew is another world."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from localization.logs.ros_stamps import stamp_from_message
from localization.types import SECOND

_BACK: Final = SECOND
"""The robot's time may go back by this much without a new run [ns]: messages of one connection are in order, but
the last of a lost connection may come late."""


@dataclass(frozen=True, slots=True)
class RobotRun:
    """What identifies a run: its identity and its map in ``/map_info``, and a clock that does not go back; a value."""

    identity: str = ""
    """Identity that the robot gave to the run; empty while it is unknown."""
    newest: int = 0
    """Newest time of the run [ns]."""
    map_sha256: str = ""
    """Hash of the robot's map; empty while it is unknown."""

    def after(self, topic: str, message: Mapping[str, Any]) -> tuple[RobotRun, bool]:
        """Return the run after a message, and whether the robot began anew with it."""
        if topic == "/map_info":
            identity, map_sha256 = str(message.get("run_id", "")), str(message["sha256"])
            other_run = bool(identity and self.identity) and identity != self.identity
            if other_run or self.map_sha256 not in ("", map_sha256):
                return RobotRun(identity, 0, map_sha256), True
            return RobotRun(identity or self.identity, self.newest, map_sha256), False
        if topic == "/clock":
            now = stamp_from_message(message["clock"])
            if now < self.newest - _BACK:
                # What else was known may be the former run's.
                return RobotRun("", now), True
            return RobotRun(self.identity, max(now, self.newest), self.map_sha256), False
        return self, False
