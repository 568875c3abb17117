"""Cameras on the robot, drawn by MuJoCo without a display: colours, depth, registered points."""

from robot_sim.cameras.camera_frame import CameraFrame as CameraFrame
from robot_sim.cameras.camera_models import (
    CAMERAS as CAMERAS,
    CameraModel as CameraModel,
    camera_named as camera_named,
)
from robot_sim.cameras.registered_points import points as points
from robot_sim.cameras.visual_state import VisualState as VisualState

# Drawing is in robot_sim.cameras.renderer: simulations without a camera do not load it.
