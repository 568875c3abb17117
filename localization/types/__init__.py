"""Vocabulary of the project: the values that flow between simulator, localiser and network.

All are frozen and their arrays read-only. Stamps are integer nanoseconds of the robot's clock, lengths
are metres, angles radians. ``map_from_base`` maps coordinates in ``base_link`` to coordinates in
``map``. Quaternions are ``wxyz`` here; ROS's ``xyzw`` appears only in messages.
"""

from localization.types.arrays import (
    BoolArray as BoolArray,
    IntArray as IntArray,
    InvalidReadingError as InvalidReadingError,
)
from localization.types.estimate import (
    Candidate as Candidate,
    Estimate as Estimate,
    Health as Health,
    HintVerdict as HintVerdict,
    Match as Match,
    Preview as Preview,
    RangeFit as RangeFit,
    ScanConsistency as ScanConsistency,
    Sweep as Sweep,
    Verdict as Verdict,
)
from localization.types.pose import (
    Pose as Pose,
    Twist as Twist,
)
from localization.types.readings import (
    GRAVITY as GRAVITY,
    SECOND as SECOND,
    Hint as Hint,
    Inertial as Inertial,
    Mounts as Mounts,
    Odometry as Odometry,
    PointScan as PointScan,
    Reading as Reading,
    Scan as Scan,
    WheelSpeeds as WheelSpeeds,
    end_of as end_of,
)
