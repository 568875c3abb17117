"""A camera in lockstep: frames that are due are drawn in the tick, while somebody wants them."""

from __future__ import annotations

from robot_sim import Simulation
from robot_sim.cameras import CameraModel
from robot_sim.cameras.renderer import CameraRenderer
from teleop.pictures.picture_hub import PictureHub
from teleop.robot.cameras.camera_topics import CameraTopics
from teleop.robot.cameras.picture_encoding import pictures_of
from teleop.rosbridge.server.server import Server


class SteppedCamera:
    """Owns the renderer, which belongs to the thread of the ticks."""

    def __init__(self, simulation: Simulation, camera: CameraModel, server: Server) -> None:
        """Prepare to draw, and advertise the camera's topics.

        Args:
            simulation: What is seen.
            camera: The camera.
            server: The robot's server, not yet started.

        Raises:
            CameraUnavailableError: If nothing can be drawn on this machine.
        """
        self._simulation = simulation
        self._renderer = CameraRenderer(simulation.world, camera)
        self.hub = PictureHub(lambda wanted: None)
        """Where viewers get pictures."""
        self.model = camera
        """The camera."""
        self._topics = CameraTopics(server, self.hub, camera)

    def ticked(self, stamp: int) -> None:
        """Draw and publish the frame that is due after a tick, if somebody wants it; ``stamp`` is its time [ns]."""
        if not self._topics.ticked(stamp) or not self.hub.wanted:
            return
        frame = self._renderer.render(self._simulation.visual_state())
        for picture in pictures_of(frame, self.model, self.hub.wanted):
            self.hub.publish(picture)

    def close(self) -> None:
        """Free the renderer."""
        self._renderer.close()
