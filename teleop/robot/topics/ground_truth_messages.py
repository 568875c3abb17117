"""Messages of the simulation's ground truth, which a real robot does not have."""

from __future__ import annotations

import numpy as np

from teleop.robot.tick_record import DriveRecord
from teleop.robot.topics.message_parts import Messages, header, odometry


def true_odometry(tick: DriveRecord) -> Messages:
    """Return the true pose in ``map`` and the true twist."""
    truth = tick.truth
    return (odometry(tick.stamp, "map", truth.map_from_base, truth.twist),)


def true_slip(tick: DriveRecord) -> Messages:
    """Return the slip of each wheel, and the instantaneous centres of rotation of body and sides."""
    slip = tick.truth.slip
    centres = np.array([slip.icr_x, slip.icr_left, slip.icr_right])
    turning = bool(np.isfinite(centres).all())
    # JSON has no NaN.
    icr_x, icr_left, icr_right = centres.tolist() if turning else (0.0, 0.0, 0.0)
    return (
        {
            "header": header(tick.stamp, "base_link"),
            "longitudinal": slip.longitudinal.tolist(),
            "lateral": slip.lateral.tolist(),
            "turning": turning,
            "icr_x": icr_x,
            "icr_left": icr_left,
            "icr_right": icr_right,
        },
    )


def true_condition(tick: DriveRecord) -> Messages:
    """Return touched objects by name, wheels on the ground, tilt, stalls and falls."""
    condition = tick.condition
    return (
        {
            "header": header(tick.stamp, "base_link"),
            "touching": list(condition.touching),
            "wheels_down": list(condition.wheels_down),
            "grounded": condition.grounded,
            "roll": condition.roll,
            "pitch": condition.pitch,
            "left_stalled": condition.left_stalled,
            "right_stalled": condition.right_stalled,
            "fallen": condition.fallen,
        },
    )
