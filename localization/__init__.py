"""Where is the robot? Readings in, estimates out; no simulator, no network.

One call on a log is ``localize``; reading by reading it is ``Localizer.add``; and each part, from the
prepared map to the filter, can be used alone from its own module.
"""

from localization.cloud import (
    Cloud as Cloud,
    CloudError as CloudError,
    load_cloud as load_cloud,
    save_cloud as save_cloud,
)
from localization.localizer import Localizer as Localizer, LocalizerConfig as LocalizerConfig
from localization.log import (
    LogError as LogError,
    ReadingsWriter as ReadingsWriter,
    read_log as read_log,
)
from localization.prepared import PreparedMap as PreparedMap, prepare as prepare
from localization.replay import (
    Localized as Localized,
    localize as localize,
    replay as replay,
)
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
