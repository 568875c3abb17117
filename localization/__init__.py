"""Localisation of a skid-steer robot in a prebuilt point cloud: readings in, estimates out.

``localize`` processes a log in one call, ``Localizer.add`` one reading at a time, and each part, from the
prepared map to the filter, can be used alone from its own module. Needs no simulator and no network.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from localization.config import LocalizerConfig as LocalizerConfig
    from localization.errors import LocalizationError as LocalizationError
    from localization.logs.log_interface import LogError as LogError
    from localization.logs.mcap_log import read_log as read_log
    from localization.logs.mcap_writer import ReadingsWriter as ReadingsWriter
    from localization.maps.cloud import (
        Cloud as Cloud,
        CloudError as CloudError,
    )
    from localization.maps.map_files import load_cloud as load_cloud, save_cloud as save_cloud
    from localization.maps.prepared_map import PreparedMap as PreparedMap, prepare as prepare
    from localization.pipeline.localizer import Localizer as Localizer
    from localization.pipeline.log_replay import Localized as Localized, localize as localize
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

_HOMES = {
    "config": ("LocalizerConfig",),
    "errors": ("LocalizationError",),
    "pipeline.localizer": ("Localizer",),
    "logs.log_interface": ("LogError",),
    "logs.mcap_log": ("read_log",),
    "logs.mcap_writer": ("ReadingsWriter",),
    "maps.cloud": ("Cloud", "CloudError"),
    "maps.map_files": ("load_cloud", "save_cloud"),
    "maps.prepared_map": ("PreparedMap", "prepare"),
    "pipeline.log_replay": ("Localized", "localize"),
    "types": (
        "Estimate",
        "Health",
        "Hint",
        "HintVerdict",
        "Inertial",
        "InvalidReadingError",
        "Match",
        "Pose",
        "Reading",
        "Scan",
        "Sweep",
        "Twist",
        "Verdict",
        "WheelSpeeds",
    ),
}
"""Modules of the names above. Each is imported when a name of it is first used: the command line offers its
commands without numpy, and the simulation uses the types without statistics and logs."""


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            value = getattr(importlib.import_module(f"localization.{home}"), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module 'localization' has no attribute {name!r}")
