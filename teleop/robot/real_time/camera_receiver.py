"""The camera as the gateway sees it: pictures come by a link, and the formats that are wanted go back."""

from __future__ import annotations

import asyncio
import contextlib

from robot_sim.cameras import CameraModel
from teleop.pictures.picture import Picture
from teleop.pictures.picture_hub import PictureHub
from teleop.robot.cameras.camera_topics import CameraTopics
from teleop.robot.real_time.channel import ChannelClosedError
from teleop.robot.real_time.picture_link import PictureLink
from teleop.rosbridge.server.server import Server


class CameraReceiver:
    """Joins the link and the hub, in the event loop of the gateway."""

    def __init__(self, link: PictureLink, camera: CameraModel, server: Server) -> None:
        """Advertise the camera's topics, and receive from now on.

        Args:
            link: The link to the camera.
            camera: The camera.
            server: The robot's server, not yet started.
        """
        self._link = link
        self.hub = PictureHub(lambda wanted: self._want())
        """Where viewers get pictures."""
        self.model = camera
        """The camera."""
        self._topics = CameraTopics(server, self.hub, camera)
        self._loop = asyncio.get_running_loop()
        self._writing = False
        self._loop.add_reader(link.fileno(), self._receive)
        self._want()

    def ticked(self, stamp: int) -> None:
        """Follow what is subscribed to; ``stamp`` is the robot's time after a tick [ns]."""
        self._topics.ticked(stamp)

    def close(self) -> None:
        """Receive no more."""
        self._loop.remove_reader(self._link.fileno())
        self._loop.remove_writer(self._link.fileno())
        self._link.close()

    def _want(self) -> None:
        with contextlib.suppress(ChannelClosedError):  # seen by the channel to control, too
            self._link.send("wanted", self.hub.wanted)
            self._flush_later()

    def _flush_later(self) -> None:
        """Have what waits sent as soon as the camera takes it."""
        if self._link.waiting and not self._writing:
            self._writing = True
            self._loop.add_writer(self._link.fileno(), self._flush)

    def _flush(self) -> None:
        self._link.flush()
        if not self._link.waiting:
            self._writing = False
            self._loop.remove_writer(self._link.fileno())

    def _receive(self) -> None:
        try:
            values = self._link.receive()
        except ChannelClosedError:
            self._loop.remove_reader(self._link.fileno())
            return
        for value in values:
            if isinstance(value, Picture):
                self.hub.publish(value)
            else:  # the camera has begun
                self._want()
