"""The emulated links of a scenario's clients."""

from __future__ import annotations

from localization.types import SECOND
from teleop.link.timeline import NEVER, LinkPeriod, LinkTimeline
from teleop.scenario.files.faults import Link
from teleop.scenario.files.scenario import Scenario


def link_of(scenario: Scenario) -> LinkTimeline:
    """Return what delays the frames of clients, and measures how long they are on their way."""
    periods = [period_of(fault) for fault in scenario.fault if isinstance(fault, Link)]
    return LinkTimeline(periods, seed=scenario.seed, clock_services=("/sim/step",))


def period_of(fault: Link) -> LinkPeriod:
    """Return the time in which a fault makes a link worse."""
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
