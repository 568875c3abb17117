"""Planar scans as ``sensor_msgs/LaserScan``, converted exactly in both directions."""

from __future__ import annotations

import numpy as np

from localization.geometry import FloatArray
from localization.logs.ros_stamps import stamp_from_message
from localization.logs.ros_types import LASER_SCAN, Message, MessageError, build, header_message
from localization.types import Scan


def _equal_steps(
    start: float, values: FloatArray, tolerance: float, *, scale: float = 1.0
) -> list[float]:
    """Return float32 steps s, most likely first, with ``start + i * s * scale`` near ``values``.

    Each value bounds the step from both sides. Every float32 of the resulting interval is a candidate; if
    there is one, the float32 nearest its middle is among them.
    """
    if len(values) < 2:
        return [0.0]
    i = np.arange(1, len(values))
    low = ((values[1:] - start - tolerance) / i).max() / scale
    high = ((values[1:] - start + tolerance) / i).min() / scale
    middle = np.float32(0.5 * (low + high))
    infinity = np.float32(np.inf)
    around = (middle, np.nextafter(middle, infinity), np.nextafter(middle, -infinity))
    return [float(step) for step in around]


def scan_message(scan: Scan) -> Message:
    """Return ``LaserScan`` of a scan whose angles and times have equal steps.

    Raises:
        MessageError: If rebuilding the scan from the message would not give the same scan.
    """
    n = len(scan.ranges)
    angle_min = float(scan.angles[0]) if n else 0.0
    offsets = scan.offsets.astype(float)
    for angle_increment in _equal_steps(angle_min, scan.angles, 0.0):
        for time_increment in _equal_steps(0.0, offsets, 0.5, scale=1e9):
            twin = Scan.uniform(
                scan.stamp,
                scan.scanner,
                angle_min=angle_min,
                angle_increment=angle_increment,
                time_increment=time_increment,
                ranges=scan.ranges,
                intensities=scan.intensities,
                range_min=scan.range_min,
                range_max=scan.range_max,
            )
            if same_scan(twin, scan):
                return build(
                    LASER_SCAN,
                    header=header_message(scan.stamp, scan.scanner),
                    angle_min=angle_min,
                    angle_max=float(scan.angles[-1]) if n else 0.0,
                    angle_increment=angle_increment,
                    time_increment=time_increment,
                    scan_time=0.0,
                    range_min=scan.range_min,
                    range_max=scan.range_max,
                    ranges=scan.ranges.astype(np.float32),
                    intensities=scan.intensities.astype(np.float32),
                )
    raise MessageError(
        f"scan of {scan.scanner} at {scan.stamp} ns has no equal float32 steps of angle and time, "
        "which LaserScan needs; build it with Scan.uniform"
    )


def same_scan(a: Scan, b: Scan) -> bool:
    """Return whether two scans are equal in every number; NaN counts as equal to NaN."""
    return (a.stamp, a.scanner, a.range_min, a.range_max) == (
        b.stamp,
        b.scanner,
        b.range_min,
        b.range_max,
    ) and all(
        np.array_equal(getattr(a, name), getattr(b, name), equal_nan=True)
        for name in ("angles", "offsets", "ranges", "intensities")
    )


def read_scan(message: Message) -> Scan:
    """Return the scan in a ``LaserScan``; its ``frame_id`` is the scanner."""
    return Scan.uniform(
        stamp_from_message(message.header.stamp),
        str(message.header.frame_id),
        angle_min=message.angle_min,
        angle_increment=message.angle_increment,
        time_increment=message.time_increment,
        ranges=message.ranges,
        intensities=message.intensities,
        range_min=message.range_min,
        range_max=message.range_max,
    )
