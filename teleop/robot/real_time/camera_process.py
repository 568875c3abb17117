"""The camera's process: draws what control shows it, in the formats that the gateway wants.

It asks for the state of the next frame when it takes one up, so that it never has a backlog, and asks for none while
nothing is wanted. Pictures go to the gateway by a link of their own.
"""

from __future__ import annotations

import os
import select
import sys
from typing import Final

from robot_sim.cameras.renderer import CameraRenderer
from robot_sim.errors import CameraUnavailableError
from teleop.pictures.picture import PictureFormat
from teleop.robot.cameras.picture_encoding import pictures_of
from teleop.robot.real_time.channel import Channel, inherited_channel
from teleop.robot.real_time.child_process import failing_to, stand_back
from teleop.robot.real_time.picture_link import PictureLink
from teleop.robot.real_time.process_messages import (
    CAMERA_BOUND,
    NEXT_STATE,
    OTHER,
    STATE,
    CameraSetup,
    Ready,
    pack,
    unpack,
)
from teleop.robot.real_time.process_name import name_process

_NICENESS: Final = 10
"""How far this process stands back behind control, gateway and estimator where processors are few."""

_PATIENCE: Final = 0.02
"""Time for which the gateway may leave a picture before the next is drawn [s]."""


class CameraProcess:
    """Owns the renderer."""

    def __init__(self, channel: Channel, link: PictureLink, setup: CameraSetup) -> None:
        """Prepare to draw.

        Raises:
            CameraUnavailableError: If nothing can be drawn on this machine.
        """
        self._channel, self._link, self._model = channel, link, setup.model
        self._renderer = CameraRenderer(setup.scene, setup.model)
        self._wanted: frozenset[PictureFormat] = frozenset()
        self._asked = False

    def run(self) -> None:
        """Draw until control ends."""
        self._channel.send(pack(OTHER, Ready()))
        # The gateway may have been there before, and answers with what it wants.
        self._link.send("begun", None)
        while True:
            receivers = [self._channel.fileno(), self._link.fileno()]
            senders = [self._link.fileno()] if self._link.waiting else []
            select.select(receivers, senders, [])
            self._link.flush()
            for wanted in self._link.receive():
                self._wanted = wanted
            payloads = self._channel.receive()
            states = [payload for payload in payloads if payload[:1] == STATE]
            if len(states) < len(payloads):
                return  # nothing else is sent but the farewell
            if states:
                self._asked = False
            if self._wanted and not self._asked:
                self._channel.send(NEXT_STATE)
                self._asked = True
            if states and self._wanted:
                self._draw(states[-1])

    def _draw(self, payload: bytes) -> None:
        frame = self._renderer.render(unpack(payload))
        for picture in pictures_of(frame, self._model, self._wanted):
            self._link.send(picture.format, picture)
        self._link.flush(_PATIENCE)


def main() -> None:
    """Run in the process that control has started."""
    name_process("camera")
    channel = inherited_channel(int(sys.argv[1]), CAMERA_BOUND)
    link = PictureLink(int(sys.argv[2]))
    stand_back(_NICENESS)
    # Mesa's software renderer would otherwise take all processors.
    os.environ.setdefault("LP_NUM_THREADS", "1")
    with failing_to(channel, CameraUnavailableError):
        setup: CameraSetup = unpack(channel.wait()[0])
        CameraProcess(channel, link, setup).run()


if __name__ == "__main__":
    main()
