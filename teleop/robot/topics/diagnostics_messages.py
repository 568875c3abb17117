"""The messages on ``/diagnostics``: the state of localisation and drive, for dashboards."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from localization.types import Health
from robot_sim.drive.robot_condition import Condition
from teleop.robot.tick_record import DriveRecord, EstimateRecord
from teleop.robot.topics.message_parts import Message, Messages, header

_OK, _WARN, _ERROR = 0, 1, 2
"""Levels of ``diagnostic_msgs/DiagnosticStatus``."""

_LEVEL: Final = {Health.TRACKING: _OK, Health.LOST: _ERROR}
"""Level by health; any other is a warning."""

_SLOW: Final = 0.95
"""Real-time factor below which the robot is said to fall behind."""


def drive_diagnostics(tick: DriveRecord) -> Messages:
    """Return the status of the drive and of the pacing of its ticks."""
    status = [_drive(tick.condition, tick.robot.name), _control(tick)]
    return ({"header": header(tick.stamp, ""), "status": status},)


def localization_diagnostics(tick: EstimateRecord) -> Messages:
    """Return the status of the localiser."""
    e = tick.estimate
    sigma = np.sqrt(np.diag(e.covariance))
    status = _status(
        _LEVEL.get(e.health, _WARN),
        "localization",
        "; ".join((e.health.value, *e.reasons)),
        "localizer",
        {
            "position sigma [mm]": f"{1e3 * float(np.hypot(sigma[0], sigma[1])):.1f}",
            "heading sigma [deg]": f"{np.rad2deg(sigma[5]):.3f}",
        },
    )
    return ({"header": header(tick.stamp, ""), "status": [status]},)


def _control(tick: DriveRecord) -> Message:
    """Return who drives, and how well the ticks keep time."""
    control, pacing = tick.control, tick.pacing
    behind = pacing.real_time_factor < _SLOW
    return _status(
        _WARN if behind else _OK,
        "control",
        "falls behind real time" if behind else "ok",
        tick.robot.name,
        {
            "controller": control.controller or "nobody",
            "control": f"{control.control.value}: {control.reason}",
            "real-time factor": f"{pacing.real_time_factor:.3f}",
            "longest gap between ticks [ms]": f"{pacing.longest_gap / 1e6:.1f}",
        },
    )


def _drive(condition: Condition, hardware: str) -> Message:
    """Return what the robot's own sensors observe of bumps, stalls and tilt."""
    bumpers = {"front bumpers": condition.bumpers.front, "rear bumpers": condition.bumpers.rear}
    return _status(
        _ERROR if condition.fallen else int(bool(condition.troubles)),
        "drive",
        "; ".join(condition.troubles) or "ok",
        hardware,
        {
            # Adding zero turns minus zero into zero.
            "roll [deg]": f"{round(np.rad2deg(condition.roll), 1) + 0.0:.1f}",
            "pitch [deg]": f"{round(np.rad2deg(condition.pitch), 1) + 0.0:.1f}",
            **{name: "".join("-#"[pressed] for pressed in ring) for name, ring in bumpers.items()},
            "left motors": "stalled" if condition.left_stalled else "ok",
            "right motors": "stalled" if condition.right_stalled else "ok",
        },
    )


def _status(
    level: int, name: str, message: str, hardware: str, values: Mapping[str, str]
) -> Message:
    return {
        "level": level,
        "name": name,
        "message": message,
        "hardware_id": hardware,
        "values": [{"key": key, "value": value} for key, value in values.items()],
    }
