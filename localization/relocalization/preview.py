"""Preview of a hint: what the last sweep would say of a pose, before anything is decided by it."""

from __future__ import annotations

import numpy as np

from localization.errors import LocalizationError
from localization.maps.prepared_map import PreparedMap
from localization.matching.registration import RegistrationConfig
from localization.relocalization.search_config import SearchConfig
from localization.relocalization.search_window import window_of
from localization.relocalization.verification import explain, outside_map, standing
from localization.types import Pose, Sweep


class PreviewError(LocalizationError):
    """A pose cannot be scored; the message says why, and what would work."""


def explained_share(
    map_from_base: Pose,
    sweep: Sweep,
    world: PreparedMap,
    level: Pose,
    config: SearchConfig = SearchConfig(),  # noqa: B008  (frozen)
    registration: RegistrationConfig = RegistrationConfig(),  # noqa: B008  (frozen)
) -> float:
    """Return the share of a sweep that the map explains at a proposed pose, in [0, 1].

    It is what the verdict about a hint says of a place: of the pose only position and heading count, the robot
    stands there as the ground and ``level`` imply, and is settled on the cloud within a few centimetres.

    Args:
        map_from_base: The proposed pose.
        sweep: Points in ``base_link``.
        world: The prepared cloud.
        level: A pose whose height, roll and pitch the robot has.
        config: The window of a hint, which may reach as far beyond the edge of the map.
        registration: How the sweep is registered.

    Raises:
        PreviewError: If the pose is outside the map.
    """
    x, y = float(map_from_base.position[0]), float(map_from_base.position[1])
    reach = window_of(map_from_base, np.zeros((6, 6)), config).half_width
    if (reason := outside_map(world, x, y, margin=reach)) is not None:
        raise PreviewError(reason)
    at = standing(world, x, y, map_from_base.yaw, level)
    return explain(sweep, world, at, registration).score
