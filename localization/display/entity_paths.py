"""Names of the entities and of the timeline in a rerun recording."""

from __future__ import annotations

from typing import Final

TIMELINE: Final = "robot time"

MAP: Final = "map"
CLOUD: Final = "map/cloud"
OVERHEAD: Final = "map/overhead"
"""Points of the map above the robot, mainly ceilings, which would hide everything below."""
LIVE: Final = "map/live"
LIVE_OVERHEAD: Final = "map/live_overhead"
BASE: Final = "map/odom/base_link"
BODY: Final = "map/odom/base_link/body"
SCANS: Final = "map/odom/base_link/scans"
"""Scans around the robot, for want of a sweep in the map."""
ESTIMATE_PATH: Final = "map/path/estimate"
TRUTH_PATH: Final = "map/path/truth"
UNCERTAINTY: Final = "map/uncertainty"
HINT: Final = "map/hint"
HYPOTHESES: Final = "map/hypotheses"
LANES: Final = "state"
LOG: Final = "log"
LEGEND: Final = "legend"
PLOTS: Final = "plots"
BANNER: Final = "banner"
"""Picture of what an operator must see at once."""
