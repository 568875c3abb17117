"""Faults of wheels and scanners, which the simulated robot knows from the start."""

from __future__ import annotations

from collections.abc import Iterable

from localization.types import SECOND
from robot_sim import ScannerFault, SlipFault
from teleop.scenario.files.faults import Fault, ScannerDead, ScannerDirty, WheelSlip

_SCANNERS = ("laser_horizontal", "laser_vertical")


def slip_faults(faults: Iterable[Fault]) -> tuple[SlipFault, ...]:
    """Return the wheels' faults of a scenario."""
    # An encoder's interval that ends as the fault begins is before it.
    return tuple(
        SlipFault(round(fault.at * SECOND) + 1, round(fault.lasting * SECOND), fault.factor)
        for fault in faults
        if isinstance(fault, WheelSlip)
    )


def scanner_faults(faults: Iterable[Fault]) -> tuple[ScannerFault, ...]:
    """Return the scanners' faults of a scenario."""
    return tuple(
        ScannerFault(
            scanner,
            round(fault.at * SECOND),
            None if fault.lasting is None else round(fault.lasting * SECOND),
            fault.share if isinstance(fault, ScannerDirty) else None,
        )
        for fault in faults
        if isinstance(fault, ScannerDead | ScannerDirty)
        for scanner in (_SCANNERS if fault.scanner == "both" else (fault.scanner,))
    )
