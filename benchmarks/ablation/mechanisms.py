"""The localiser's mechanisms, each with the settings that switch it off.

Most have no switch of their own: a threshold that nothing reaches, or a noise of zero, takes them out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from localization.pipeline.localizer import LocalizerConfig

Change = Callable[[LocalizerConfig], LocalizerConfig]
"""Returns the settings without a mechanism."""

ALL = "all"
"""Name of the localiser as it is."""

REMOVED = (
    "agreement over a way",
    "bound of KISS-ICP's turns",
    "end of comparing",
    "gain of a wider prior",
    "growth of what passes through the map",
    "information by sweep period",
    "jumps after gaps",
    "most that one sweep says",
    "mount uncertainty",
    "overspeed margin",
    "slip memory",
    "slip window",
)
"""Mechanisms that were a setting when the kept figures were measured and are none any more: their rows stay in
the sheet as the reason for that, and cannot be run."""

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
    "KISS-ICP odometry": without(kiss_odometry=False),
    "wider priors": without(retry_sigma=()),
    "wider priors for what fits badly": without(retry_below=0.0),
    "wider priors while wheels slip": without(good_inlier_ratio=2.0),
    "acceleration limit": without("wheels", max_acceleration=1e6),
    "slip that lasts": without("wheels", rates=(0.014, 1e3)),
    "annealed kernel": without("registration", kernel_wide=0.04, rough_kernel_wide=0.1),
    "debiasing": without("registration", debias=0.04),
    "effective points": without("registration", effective_points=math.inf),
    "noise along rough walls": without("registration", tangential=0.0),
    "rough maps": without("registration", rough=math.inf),
    "information by way": without(sweep_distance=math.inf),
    "noise that a place shares": without(map_share=0.0),
    "minimum inlier ratio": without(min_inlier_ratio=0.0),
    "bias of ranges": without("ekf", range_bias=1e-6),
    "standstill detection": without("ekf", still_speed=0.0),
    "rest after a push": without("ekf", still_recover=0.2),
    "standstill floor": without("ekf", still_position=0.0, still_angle=0.0),
    "wheel calibration": without(
        "ekf", skid_steer=(1e-6, 1e-6, 1e-6, 1e-6), skid_steer_walk=(0.0, 0.0, 0.0, 0.0)
    ),
    "tilt by accelerometer": without("ekf", tilt=1e3),
    "evidence of being carried": without("belief", carried=0.0),
    "sweeps that share their errors": without("belief", independent=(1e-9, 1e-9, 0.2)),
    "poses that mostly fit": without("belief", mostly=2.0),
    "lasting doubt before a check": without("health", check_after=0.0),
    "largest sigma": without("health", lost_sigma=math.inf),
    "neighbours along a corridor": without("search", compared=0),
    "waiting between searches": without("search_schedule", distance=0.0, period=0),
    "work bound": without("map_search", max_work=_NEVER),
    "extrinsics monitor": without("extrinsics_monitor", sigmas=math.inf),
    "late readings": without("late_readings", horizon=0),
    "registration cache": without("late_readings", reuse_distance=0.0, reuse_angle=0.0),
}
"""By name: what takes each of them out."""
