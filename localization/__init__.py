"""Localisation of a skid-steer robot in a prebuilt point cloud: readings in, estimates out.

``localize`` processes a log in one call, ``Localizer.add`` one reading at a time, and each part, from the
prepared map to the filter, can be used alone from its own module. Needs no simulator and no network.
"""

import importlib
from typing import TYPE_CHECKING, Any

from localization.errors import LocalizationError as LocalizationError
from localization.types import (
    Estimate as Estimate,
    Health as Health,
    Hint as Hint,
    HintVerdict as HintVerdict,
    Inertial as Inertial,
    InvalidReadingError as InvalidReadingError,
    Match as Match,
    Pose as Pose,
    Reading as Reading,
    Scan as Scan,
    Sweep as Sweep,
    Twist as Twist,
    Verdict as Verdict,
    WheelSpeeds as WheelSpeeds,
)

if TYPE_CHECKING:
    from localization.config import LocalizerConfig as LocalizerConfig
    from localization.logs.mcap_log import (
        LogError as LogError,
        ReadingsWriter as ReadingsWriter,
        read_log as read_log,
    )
    from localization.maps.cloud import (
        Cloud as Cloud,
        CloudError as CloudError,
        load_cloud as load_cloud,
        save_cloud as save_cloud,
    )
    from localization.maps.prepared_map import PreparedMap as PreparedMap, prepare as prepare
    from localization.pipeline.localizer import Localizer as Localizer
    from localization.pipeline.log_replay import Localized as Localized, localize as localize

_HOMES = {
    "config": ("LocalizerConfig",),
    "pipeline.localizer": ("Localizer",),
    "logs.mcap_log": ("LogError", "ReadingsWriter", "read_log"),
    "maps.cloud": ("Cloud", "CloudError", "load_cloud", "save_cloud"),
    "maps.prepared_map": ("PreparedMap", "prepare"),
    "pipeline.log_replay": ("Localized", "localize"),
}
"""Modules of the heavier names, which are imported at their first use: the vocabulary alone, as the simulation needs
it, is imported without a second's wait for statistics and logs."""


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            value = getattr(importlib.import_module(f"localization.{home}"), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module 'localization' has no attribute {name!r}")
