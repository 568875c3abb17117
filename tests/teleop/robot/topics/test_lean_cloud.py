"""``/local_cloud/lean``: what its bytes mean, and that they are what ``/local_cloud`` holds."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial import cKDTree

from teleop.robot.topics.lean_cloud import MOST_POINTS, RESOLUTION, packed
from tests.teleop.robot.topics.test_published_messages import points_of
from tests.teleop.support import ROOT, SPAWN, Robots, arm, drive, hint_message, in_a_loop, peer

FloatArray = np.ndarray[Any, np.dtype[np.float64]]


def unpacked(data: bytes) -> tuple[FloatArray, FloatArray]:
    """Return points (N, 3) [m] and distances (N,) [m], as the definition of the message says."""
    raw = np.frombuffer(data, np.uint8).reshape(-1, 7)
    steps = np.ascontiguousarray(raw[:, :6]).view("<i2").astype(float)
    distance = raw[:, 6].astype(float) / 100.0
    distance[raw[:, 6] == 255] = np.nan
    return steps * RESOLUTION, distance


@given(
    points=st.integers(0, 900).flatmap(
        lambda n: arrays(np.float64, (n, 3), elements=st.floats(-40.0, 40.0, width=32))
    ),
    seed=st.integers(0, 99),
)
def test_packed_points_are_points_of_the_sweep_with_their_distances(
    points: FloatArray, seed: int
) -> None:
    distances = np.random.default_rng(seed).uniform(-4.0, 4.0, len(points))
    distances[::3] = np.nan
    found, away = unpacked(packed(points, distances))
    assert len(found) <= min(MOST_POINTS, len(points))
    assert bool(len(found)) == bool(len(points))
    if len(points):
        off = np.abs(found[:, None] - points[None]).max(axis=2)
        same = off <= 0.5 * RESOLUTION + 1e-9
        expected = np.minimum(np.rint(np.abs(distances) * 100.0), 254.0) / 100.0
        agrees = np.isclose(away[:, None], expected[None], equal_nan=True)
        assert (same & agrees).any(axis=1).all()


def test_sweep_of_many_points_is_thinned_evenly() -> None:
    rng = np.random.default_rng(0)
    wall = rng.uniform([-5.0, 2.0, 0.0], [5.0, 2.0, 3.0], (20_000, 3))
    found, _ = unpacked(packed(wall, np.zeros(20_000)))
    assert MOST_POINTS // 2 < len(found) <= MOST_POINTS
    assert cKDTree(found).query(wall)[0].max() < 0.7


def test_points_beyond_the_range_of_their_numbers_are_left_out() -> None:
    points = np.array([[1.0, 2.0, 3.0], [656.0, 0.0, 0.0], [0.0, -1e300, 0.0], [-655.36, 0.0, 0.0]])
    found, away = unpacked(packed(points, np.array([9.0, 0.0, 0.0, np.nan])))
    assert found.tolist() == pytest.approx(np.array([[1.0, 2.0, 3.0], [-655.36, 0.0, 0.0]]))
    assert away[0] == 2.54
    assert np.isnan(away[1])


@pytest.mark.slow
@in_a_loop
async def test_lean_cloud_is_on_the_cloud_of_the_same_time_twice_a_second(robots: Robots) -> None:
    async with robots() as rig, peer(rig.server.url) as client:
        await client.hint(hint_message(*SPAWN))
        await client.step(50)
        await client.subscribe("/local_cloud", "/local_cloud/lean", compression="cbor")
        await client.step(150)
        whole = {str(m["header"]["stamp"]): points_of(m) for m in client.messages("/local_cloud")}
        lean = client.messages("/local_cloud/lean")
        assert len(lean) == 6
        for message in lean:
            assert message["header"]["frame_id"] == "map"
            assert message["resolution"] == pytest.approx(RESOLUTION)
            table = whole[str(message["header"]["stamp"])]
            points, distances = unpacked(message["data"])
            assert 100 < len(points) <= MOST_POINTS
            points += [message["origin"][axis] for axis in "xyz"]
            off, index = cKDTree(table[:, :3]).query(points)
            assert off.max() < 0.02
            known = np.isfinite(distances) & (off < 0.005)
            expected = np.abs(table[index[known], 4])
            assert np.abs(distances[known] - expected).max() < 0.02


RATES = {
    "/tf": 100,
    "/amcl_pose": 500,
    "/teleop/state": 100,
    "/localization/status": 200,
    "/localization/candidates": 500,
    "/local_cloud/lean": 0,
}
"""``throttle_rate`` [ms] that the documentation proposes for a slow link, by topic."""

OVERHEAD = 4 + 52
"""Head of a WebSocket frame, and of a TCP/IP packet of its own, with time stamps [bytes]."""


def rates_of_the_page() -> dict[str, int]:
    """Return the table of the documentation."""
    text = (ROOT / "docs" / "teleoperation.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(/\S+)` \| (\d+) \| [\d.]+ \|$", text, re.MULTILINE)
    return {topic: int(rate) for topic, rate in rows}


@pytest.mark.slow
@in_a_loop
@pytest.mark.parametrize("throttled", [True, False])
async def test_picture_for_a_slow_link_stays_within_256_kbit_a_second(
    throttled: bool, robots: Robots
) -> None:
    assert rates_of_the_page() == RATES
    seconds = 4
    async with robots() as rig, peer(rig.server.url) as client:
        rig.place()
        await client.step(50)
        for topic, rate in RATES.items():
            options = {"throttle_rate": rate} if throttled else {}
            await client.send(op="subscribe", topic=topic, compression="cbor", **options)
        await arm(client)
        before = len(client.frames)
        await drive(client, 0.8, steps=seconds * 10)
        spent: dict[str, int] = dict.fromkeys(RATES, 0)
        for frame, message in zip(client.frames[before:], client.received[before:], strict=True):
            if message["op"] == "publish":
                spent[message["topic"]] += len(frame) + OVERHEAD
        kbits = {topic: 8 * size / seconds / 1000 for topic, size in spent.items()}
        assert all(kbits.values())
        assert client.last("/local_cloud/lean")
        if throttled:
            assert sum(kbits.values()) <= 150
        else:
            assert sum(kbits.values()) - kbits["/localization/candidates"] <= 256
