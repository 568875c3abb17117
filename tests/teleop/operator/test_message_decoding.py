"""Decoding of message dictionaries: values, and invalid messages."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from teleop.operator.message_decoding import (
    DecodeError,
    cloud_of,
    covariance_of,
    stamp_of,
)


def a_cloud(table: np.ndarray, names: tuple[str, ...], **changes: Any) -> dict[str, Any]:
    """Return a ``PointCloud2`` of float32 columns."""
    fields = [{"name": n, "offset": 4 * i, "datatype": 7, "count": 1} for i, n in enumerate(names)]
    message = {
        "height": 1,
        "width": len(table),
        "fields": fields,
        "is_bigendian": False,
        "point_step": 4 * len(names),
        "row_step": table.nbytes,
        "data": table.astype("<f4").tobytes(),
        "is_dense": True,
    }
    return {**message, **changes}


def test_cloud_gives_points_and_distances() -> None:
    table = np.array([[1, 2, 3, 0, 0.1], [4, 5, 6, 0, np.nan]])
    points, distances = cloud_of(a_cloud(table, ("x", "y", "z", "intensity", "distance")))
    assert points.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert distances[0] == np.float32(0.1)
    assert np.isnan(distances[1])


def test_cloud_without_distance_gives_nan() -> None:
    points, distances = cloud_of(a_cloud(np.ones((2, 3)), ("z", "y", "x")))
    assert len(points) == 2
    assert np.isnan(distances).all()


def test_points_that_are_not_finite_are_left_out() -> None:
    table = np.array([[1, 2, 3], [np.nan, 0, 0], [0, np.inf, 0]])
    points, _ = cloud_of(a_cloud(table, ("x", "y", "z")))
    assert points.tolist() == [[1, 2, 3]]


def test_cloud_in_the_other_byte_order_is_read() -> None:
    table = np.array([[1, 2, 3]])
    message = a_cloud(table, ("x", "y", "z"), is_bigendian=True, data=table.astype(">f4").tobytes())
    assert cloud_of(message)[0].tolist() == [[1, 2, 3]]


def test_empty_cloud_is_no_error() -> None:
    points, distances = cloud_of(a_cloud(np.zeros((0, 3)), ("x", "y", "z")))
    assert points.shape == (0, 3)
    assert distances.shape == (0,)


def test_cloud_with_too_few_bytes_is_refused() -> None:
    message = a_cloud(np.ones((2, 3)), ("x", "y", "z"), data=b"\0" * 20)
    with pytest.raises(DecodeError, match="2 points need 24 bytes, got 20"):
        cloud_of(message)


def test_cloud_without_coordinates_is_refused() -> None:
    with pytest.raises(DecodeError, match="no float32 field z"):
        cloud_of(a_cloud(np.ones((2, 2)), ("x", "y")))


def test_stamps_of_both_ros_generations_are_read() -> None:
    for stamp in ({"sec": 2, "nanosec": 5}, {"secs": 2, "nsecs": 5}):
        assert stamp_of({"header": {"stamp": stamp}}) == 2_000_000_005
    assert stamp_of({"header": {"frame_id": "map"}}) is stamp_of({}) is None


@pytest.mark.parametrize("value", [np.zeros(35), [np.nan] * 36])
def test_covariance_needs_36_finite_numbers(value: object) -> None:
    with pytest.raises(DecodeError, match="36 finite"):
        covariance_of(value)  # type: ignore[arg-type]
