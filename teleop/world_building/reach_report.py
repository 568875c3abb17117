"""Lines about what a survey reaches, for the summaries of ``farsteer world`` and ``farsteer map``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from localization.maps.grid_image import Borderline
from robot_sim.layout.gaps import Gap
from robot_sim.layout.route_planning import straight_clearance, turning_clearance
from robot_sim.layout.survey_reach import MissedFloor, Reach
from robot_sim.robot.skid_steer_parameters import SkidSteer

_LISTED: Final = 10
"""Number of missed areas that are listed one by one."""
_GAPS: Final = 3
"""Number of gaps that are listed for one area."""


def reach_lines(reach: Reach, robot: SkidSteer) -> Iterator[str]:
    """Yield a line with the share of the floor that a survey reaches, and one for each area that it does not."""
    # No share that is less than all is rounded to all.
    percent = int(100.0 * reach.share + 1e-9)
    yield f"reach     the survey comes near {percent} % of the free floor, {reach.area:.0f} m2"
    for missed in reach.missed[:_LISTED]:
        yield f"          not near {missed.area:.0f} m2 round {_at(missed)}: {_cause(missed)}"
    if rest := reach.missed[_LISTED:]:
        area = sum(m.area for m in rest)
        yield f"          nor near {len(rest)} more areas, {area:.0f} m2 in all"
    if any(m.gaps or m.tight for m in reach.missed):
        straight, turning = 2.0 * straight_clearance(robot), 2.0 * turning_clearance(robot)
        yield (
            f"          the robot takes passages from {straight:.2f} m straight ahead, and turns where"
            f" there are {turning:.2f} m"
        )


def borderline_lines(borderline: Sequence[Borderline]) -> Iterator[str]:
    """Yield a line for each group of cells near a threshold."""
    for group in borderline:
        yield (
            f"threshold {group.cells} {group.kind} cells are within {group.within:g} of {group.threshold}, most of"
            f" them grey {group.grey} with occupancy {group.occupancy:.3f}: another threshold would change"
            " what they are"
        )


def _cause(missed: MissedFloor) -> str:
    if missed.gaps:
        listed = ", ".join(_gap(gap) for gap in missed.gaps[:_GAPS])
        return f"behind {listed}{' and more' if len(missed.gaps) > _GAPS else ''}"
    if not missed.open:
        return "there is no opening"
    if missed.tight is not None:
        return f"the way there leaves no room to turn: {missed.tight.width:.2f} m at {_at(missed.tight)}"
    return "the route does not lead there"


def _gap(gap: Gap) -> str:
    return f"a gap {gap.width:.2f} m wide at {_at(gap)}"


def _at(place: Gap | MissedFloor) -> str:
    return f"({place.x:.1f}, {place.y:.1f})"
