"""Giving a robot in lockstep its camera, or none where nothing can be drawn; a robot without one loads nothing of it."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from robot_sim import Simulation
from teleop.rosbridge.server.server import Server

if TYPE_CHECKING:
    from teleop.robot.cameras.stepped_camera import SteppedCamera

_LOG: Final = logging.getLogger(__name__)


def without_camera(error: Exception) -> None:
    """Say that the robot has no camera, and why."""
    _LOG.warning("serving without a camera: %s", str(error) or "its process has ended")


def stepped_camera(
    simulation: Simulation,
    name: str | None,
    server: Server,
    *,
    without: Callable[[Exception], None] = without_camera,
) -> SteppedCamera | None:
    """Return the camera of a robot in lockstep, if one is wanted and something can be drawn.

    Args:
        simulation: What is seen.
        name: Name of the camera; None for none.
        server: The robot's server, not yet started.
        without: Called with the reason if nothing can be drawn.

    Raises:
        CameraError: If there is no camera of that name.
    """
    if name is None:
        return None
    from robot_sim.cameras import camera_named
    from robot_sim.errors import CameraUnavailableError
    from teleop.robot.cameras.stepped_camera import SteppedCamera

    try:
        return SteppedCamera(simulation, camera_named(name), server)
    except CameraUnavailableError as error:
        without(error)
        return None
