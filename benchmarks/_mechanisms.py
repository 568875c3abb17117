"""The localiser's mechanisms, each with the settings that switch it off.

Most have no switch of their own: a threshold that nothing reaches, or a noise of zero, takes them out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from localization.localizer import LocalizerConfig

Change = Callable[[LocalizerConfig], LocalizerConfig]
"""Returns the settings without a mechanism."""

ALL = "all"
"""Name of the localiser as it is."""

_NEVER = 1 << 60
"""A count or a time [ns] that no drive reaches."""


def without(part: str = "", **settings: Any) -> Change:
    """Return the change that replaces some settings of a part of the configuration.

    Args:
        part: field of ``LocalizerConfig``; its own fields if empty.
        settings: by name.
    """

    def change(config: LocalizerConfig) -> LocalizerConfig:
        if not part:
            return replace(config, **settings)
        return replace(config, **{part: replace(getattr(config, part), **settings)})

    return change


def both(*changes: Change) -> Change:
    """Return several changes, one after the other."""

    def change(config: LocalizerConfig) -> LocalizerConfig:
        for each in changes:
            config = each(config)
        return config

    return change


MECHANISMS: Mapping[str, Change] = {
    "second opinion": without(second_opinion=False),
    "KISS-ICP odometry": without(kiss_odometry=False),
    "wheel blame rule": without(blame_fit=2.0),
    "KISS-ICP held to the wheels": without(shove=math.inf),
    "slip by wheels against gyro": without("ekf", wheel_yaw_gate=math.inf),
    "slip by traction": without(traction=math.inf),
    "facing gate": without("registration", facing=False),
    "annealed kernel": without("registration", kernel_wide=0.04),
    "debiasing": without("registration", debias=0.0),
    "weakest kept direction": without("registration", weakest=math.inf),
    "effective points": without("registration", effective_points=math.inf),
    "sweep's share by period": without(sweep_period=1e-9),
    "least fit": without(least_fit=0.0),
    "mount uncertainty": without("ekf", mount_position=0.0, mount_angle=0.0),
    "standstill": without("ekf", still_speed=0.0),
    "wheel calibration": without(
        "ekf", kappa=(1e-6, 1e-6, 1e-6, 1e-6), kappa_walk=(0.0, 0.0, 0.0, 0.0)
    ),
    "tilt by accelerometer": without("ekf", tilt_gate=0.0),
    "jump detection": without("continuity", least=0.0, blind=_NEVER),
    "beams through surfaces": without("health", through=2.0),
    "patience in a crowd": without("health", blind_after=12),
    "off the map": without("health", off_map=2.0),
    "places told apart on the way": without("hypotheses", sweeps=1, least_way=0.0),
    "mount watch": without("mounts", step=math.inf, turn=math.inf),
    "late readings": without("rewind", horizon=0),
    "registration recall": without("rewind", moved=0.0, turned=0.0),
}
"""By name: what takes each of them out."""
