"""Where is the robot? Readings in, estimates out; no simulator, no network.

One call on a log is ``localize``; reading by reading it is ``Localizer.add``; and each part, from the
prepared map to the filter, can be used alone from its own module.
"""

import importlib
from typing import TYPE_CHECKING, Any

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
    from localization.logs.log_interface import LogError as LogError
    from localization.logs.mcap_log import read_log as read_log
    from localization.logs.mcap_writer import ReadingsWriter as ReadingsWriter
    from localization.maps.cloud import (
        Cloud as Cloud,
        CloudError as CloudError,
    )
    from localization.maps.map_files import load_cloud as load_cloud, save_cloud as save_cloud
    from localization.maps.prepared_map import PreparedMap as PreparedMap, prepare as prepare
    from localization.pipeline.localizer import (
        Localizer as Localizer,
        LocalizerConfig as LocalizerConfig,
    )
    from localization.pipeline.log_replay import Localized as Localized, localize as localize

_HOMES = {
    "pipeline.localizer": ("Localizer", "LocalizerConfig"),
    "logs.log_interface": ("LogError",),
    "logs.mcap_log": ("read_log",),
    "logs.mcap_writer": ("ReadingsWriter",),
    "maps.cloud": ("Cloud", "CloudError"),
    "maps.map_files": ("load_cloud", "save_cloud"),
    "maps.prepared_map": ("PreparedMap", "prepare"),
    "pipeline.log_replay": ("Localized", "localize"),
}
"""Which module each of the heavier names is in. They are imported when first asked for: whoever wants
the vocabulary alone, as the simulation does, need not wait a second for statistics and logs."""


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            value = getattr(importlib.import_module(f"localization.{home}"), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module 'localization' has no attribute {name!r}")
