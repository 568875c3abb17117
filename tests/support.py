"""Values for the tests: poses and readings of every kind, made by hand or by hypothesis."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from localization.types import Hint, Inertial, Pose, Reading, Scan, WheelSpeeds

MOUNTS = {
    "laser_horizontal": Pose.planar(0.2, 0.0, 0.0),
    "laser_vertical": Pose.from_euler([-0.1, 0.0, 0.4], pitch=np.pi / 2),
}


def floats(low: float, high: float) -> st.SearchStrategy[float]:
    """Finite numbers in [low, high]."""
    return st.floats(low, high, allow_nan=False, allow_infinity=False)


def vectors(size: int, bound: float = 100.0) -> st.SearchStrategy[np.ndarray]:
    """Arrays (size,) with elements in [-bound, bound]."""
    return hnp.arrays(float, size, elements=floats(-bound, bound))


def rotation_vectors(longest: float = np.pi) -> st.SearchStrategy[np.ndarray]:
    """Rotation vectors (3,) [rad]: of any direction and any angle up to ``longest``, tiny ones too."""
    directions = vectors(3, 1.0).filter(lambda v: np.linalg.norm(v) > 1e-3)
    angles = st.one_of(
        floats(0.0, longest),
        st.sampled_from([0.0, 1e-16, 1e-12, 1e-8, 1e-5, longest, longest - 1e-9, longest - 1e-5]),
    )
    return st.builds(lambda v, a: a * v / np.linalg.norm(v), directions, angles)


def poses(bound: float = 100.0) -> st.SearchStrategy[Pose]:
    """Poses within ``bound`` [m] of the origin, of any attitude."""
    quaternions = vectors(4, 1.0).filter(lambda q: np.linalg.norm(q) > 1e-2)
    return st.builds(Pose, vectors(3, bound), quaternions)


stamps = st.integers(0, 2**31 * 10**9 - 1)


@st.composite
def scans(draw: st.DrawFn) -> Scan:
    """Scans with equal steps, of any size, with and without returns and intensities."""
    n = draw(st.integers(0, 400))
    legal = st.one_of(
        floats(0.0, 100.0).map(np.float32),
        st.sampled_from([np.float32(np.inf), np.float32(np.nan)]),
    )
    ranges = draw(hnp.arrays(np.float32, n, elements=legal, fill=st.just(np.float32(1.0))))
    with_intensities = draw(st.booleans())
    return Scan.uniform(
        draw(stamps),
        draw(st.sampled_from(sorted(MOUNTS))),
        angle_min=draw(floats(-np.pi, np.pi)),
        angle_increment=draw(st.sampled_from([-1, 1])) * draw(floats(1e-4, 0.1)),
        time_increment=draw(st.one_of(st.just(0.0), floats(1e-7, 1e-2))),
        ranges=ranges,
        intensities=np.arange(n) if with_intensities else (),
        range_min=draw(floats(0.0, 1.0)),
        range_max=draw(floats(1.0, 200.0)),
    )


@st.composite
def wheel_speeds(draw: st.DrawFn) -> WheelSpeeds:
    """Wheel speeds of float32 resolution."""
    speed = st.floats(-3.0, 3.0, width=32)
    return WheelSpeeds(draw(stamps), draw(speed), draw(speed))


def inertials() -> st.SearchStrategy[Inertial]:
    """Gyro and accelerometer readings."""
    return st.builds(Inertial, stamps, vectors(3), vectors(3))


@st.composite
def hints(draw: st.DrawFn) -> Hint:
    """Hints with a symmetric covariance, at times all zeros."""
    root = draw(vectors(36, 3.0)).reshape(6, 6)
    return Hint(draw(stamps), draw(poses()), root @ root.T)


def readings() -> st.SearchStrategy[Reading]:
    """Readings of every kind."""
    return st.one_of(scans(), wheel_speeds(), inertials(), hints())


def bits(value: object) -> object:
    """Return what two values must have in common to be the same to the last bit."""
    match value:
        case np.ndarray():
            return value.shape, value.dtype.str, value.tobytes()
        case Pose():
            return bits(value.position), bits(value.quaternion_wxyz)
        case Scan() | WheelSpeeds() | Inertial() | Hint():
            fields = type(value).__slots__
            return type(value), tuple(bits(getattr(value, name)) for name in fields)
        case float():
            return np.float64(value).tobytes()
        case _:
            return value


def a_drive(seconds: float = 2.0) -> list[tuple[int, Reading]]:
    """Return the readings of a short, made-up drive with the times [ns] they were given."""
    rng = np.random.default_rng(1)
    drive: list[tuple[int, Reading]] = []
    for tick in range(1, int(seconds * 50) + 1):
        now = tick * 20_000_000
        speed = float(np.float32(0.3 + 0.01 * rng.standard_normal()))
        drive.append((now, WheelSpeeds(now, speed, speed)))
        drive.append((now, Inertial(now, rng.standard_normal(3), np.array([0.0, 0.0, 9.81]))))
        if tick % 5 == 0:
            for scanner in MOUNTS:
                drive.append((now, a_scan(now - 100_000_000, scanner, rng.uniform(1.0, 9.0, 541))))
    return drive


def a_scan(
    stamp: int = 0, scanner: str = "laser_horizontal", ranges: object = (1.0, 2.0, 3.0)
) -> Scan:
    """Return a scan with a quarter of a degree and 0.1 ms between beams."""
    return Scan.uniform(
        stamp,
        scanner,
        angle_min=-2.0,
        angle_increment=np.deg2rad(0.25),
        time_increment=1e-4,
        ranges=np.asarray(ranges),
        range_min=0.02,
        range_max=30.0,
    )
