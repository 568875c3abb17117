"""Error between two poses as a vector, and the length that makes rotations comparable with shifts."""

from __future__ import annotations

import numpy as np

from localization.geometry import FloatArray, so3_log
from localization.types import Pose

LEVER = 5.0
"""A rotation error counts like the shift that it causes at this distance, the size of a room [m]."""


def difference(reference: Pose, pose: Pose) -> FloatArray:
    """Return the error (6,) that leads from reference to pose: position in map [m], rotation in base [rad]."""
    return np.concatenate(
        [pose.position - reference.position, so3_log(reference.rotation.T @ pose.rotation)]
    )
