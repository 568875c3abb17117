"""The topics of a second arm that follows: its angles come in, and how far it is off goes out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robot_sim.arm.arm_table import ArmTable
from teleop.robot.arm.mirror import ArmMirror
from teleop.robot.tick_record import DriveRecord
from teleop.robot.topics.arm_messages import BASE
from teleop.robot.topics.arm_topics import MIRROR_DEGREES
from teleop.robot.topics.message_parts import Messages, header
from teleop.rosbridge.errors import MessageError
from teleop.rosbridge.server.server import Server


class MirrorTopic:
    """Compares the second arm with the robot's, by the times at which both became known here."""

    def __init__(self, server: Server, table: ArmTable) -> None:
        """Subscribe to the second arm's angles."""
        self._server, self._mirror = server, ArmMirror(table)
        self._connections = server.protocol.connections
        server.protocol.topics.subscribe(MIRROR_DEGREES.name, MIRROR_DEGREES.type, self._take)

    def driven(self, tick: DriveRecord) -> None:
        """Note where the robot's arm is."""
        if tick.arm is not None:
            self._mirror.moved(self._server.now, tick.arm.angles)

    def messages(self, tick: DriveRecord) -> Messages:
        """Return how the second arm does, if there has been one."""
        state = self._mirror.state(self._server.now)
        if state is None:
            return ()
        return (
            {
                "header": header(tick.stamp, BASE),
                "angles": state.angles,
                "error": state.error,
                "behind": state.behind,
                "age": state.age,
                "state": state.status,
                "reason": state.reason,
            },
        )

    def _take(self, client: int, message: Mapping[str, Any], now: int) -> None:
        labels = [dimension["label"] for dimension in message["layout"]["dim"]]
        refusal = self._mirror.take(
            now,
            message["data"],
            source=self._connections.name(client),
            measured=labels[:1] != ["written"],
        )
        if refusal:
            raise MessageError(refusal)
