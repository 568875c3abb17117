"""The emulated links of a scenario's clients."""

from __future__ import annotations

from collections.abc import Callable

from localization.types import SECOND
from teleop.link.timeline import NEVER, LinkPeriod, LinkTimeline
from teleop.rosbridge.protocol.connection import Connection
from teleop.scenario.files.faults import Link
from teleop.scenario.files.scenario import Scenario


def link_of(
    scenario: Scenario, exempt: Callable[[Connection], bool] = lambda connection: False
) -> LinkTimeline:
    """Return what delays the frames of clients, and measures how long they are on their way.

    Args:
        scenario: The scenario.
        exempt: Returns whether a connection is on no link.
    """
    periods = [_period(fault) for fault in scenario.fault if isinstance(fault, Link)]
    return LinkTimeline(periods, seed=scenario.seed, exempt=exempt, clock_services=("/sim/step",))


def _period(fault: Link) -> LinkPeriod:
    end = NEVER if fault.lasting is None else round((fault.at + fault.lasting) * SECOND)
    return LinkPeriod(
        round(fault.at * SECOND),
        end,
        fault.direction,
        fault.client,
        fault.delay,
        fault.jitter,
        fault.rate,
        fault.blackout,
    )
