"""Starting the camera's process, or serving without one where nothing can be drawn."""

from __future__ import annotations

from robot_sim import Simulation, World
from robot_sim.cameras import CameraModel, camera_named
from robot_sim.cameras.renderer import camera_scene
from robot_sim.errors import CameraUnavailableError
from teleop.robot.real_time.camera_feed import CameraFeed
from teleop.robot.real_time.channel import ChannelClosedError
from teleop.robot.real_time.child_process import ChildProcess
from teleop.robot.real_time.picture_link import socket_pair
from teleop.robot.real_time.process_messages import CAMERA_BOUND, OTHER, CameraSetup, pack
from teleop.robot.serving.camera_choice import without_camera


class CameraStart:
    """A camera's process that is being started."""

    def __init__(self, world: World, name: str) -> None:
        """Start the process, which loads its libraries and compiles what it draws.

        Args:
            world: The world.
            name: Name of the camera.

        Raises:
            CameraError: If there is no camera of that name.
        """
        self.model: CameraModel | None = camera_named(name)
        """The camera; None if it turned out that nothing can be drawn."""
        self._ours, self._theirs = socket_pair()
        # Made once: another process must be started between two ticks.
        self._setup = pack(OTHER, CameraSetup(camera_scene(world), self.model))
        self._process = self._start()

    @property
    def link(self) -> int:
        """Descriptor of the end at which pictures arrive."""
        return self._theirs.fileno()

    def _start(self) -> ChildProcess:
        module = "teleop.robot.real_time.camera_process"
        process = ChildProcess(module, CAMERA_BOUND, self._ours.fileno())
        process.channel.send(self._setup)
        return process

    def feed(self, simulation: Simulation) -> CameraFeed | None:
        """Wait until it can draw, and return what feeds it; if it cannot, say so in one line and return None."""
        assert self.model is not None
        try:
            self._process.ready()
        except (CameraUnavailableError, ChannelClosedError) as error:
            without_camera(error)
            self.model = None
            self._process.kill()
            return None
        rate = self.model.rate
        return CameraFeed(self._process, simulation, rate, restart=self._start)

    def kill(self) -> None:
        """End the process at once."""
        self._process.kill()
        self.close()

    def close(self) -> None:
        """Close the link, when no process will need it any more."""
        self._ours.close()
        self._theirs.close()
