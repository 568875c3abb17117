"""The display: every topic has its entities, nothing stops it, and a long drive costs no more."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from localization.display import entity_paths as at
from localization.display.rerun_sink import Sink
from localization.maps.cloud import Cloud
from localization.types import SECOND, Pose
from teleop.operator.display.display import HINT_SHOWN, Display
from teleop.operator.display.display_layout import LANE_COLOURS, SERIES
from tests.teleop.operator.support import Moment, column, events, play, rows


@pytest.fixture
def display(cloud: Cloud, tmp_path: Path) -> Iterator[Display]:
    display = Display(cloud, sink=Sink(file=tmp_path / "x.rrd"), strict=True)
    yield display
    display.close()


def _stamp(ns: int) -> dict[str, int]:
    return {"sec": ns // SECOND, "nanosec": ns % SECOND}


def _pose(x: float, y: float = 0.0) -> dict[str, Any]:
    return {
        "position": {"x": x, "y": y, "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    }


def _tf(stamp: int, x: float) -> dict[str, Any]:
    def link(parent: str, child: str, x: float) -> dict[str, Any]:
        pose = _pose(x)
        transform = {"translation": pose["position"], "rotation": pose["orientation"]}
        header = {"stamp": _stamp(stamp), "frame_id": parent}
        return {"header": header, "child_frame_id": child, "transform": transform}

    return {"transforms": [link("map", "odom", 0.0), link("odom", "base_link", x)]}


def _verdict(stamp: int, verdict: str, candidates: int) -> dict[str, Any]:
    return {
        "header": {"stamp": _stamp(stamp), "frame_id": "map"},
        "verdict": verdict,
        "reason": "because",
        "hint": _pose(1.0),
        "candidates": [_pose(1.5 + i) for i in range(candidates)],
        "scores": [0.9 - 0.1 * i for i in range(candidates)],
    }


def _status(stamp: int, health: str, *reasons: str) -> dict[str, Any]:
    return {
        "header": {"stamp": _stamp(stamp), "frame_id": "map"},
        "health": health,
        "reasons": list(reasons),
        "fit": 0.9,
        "nis": 1.0,
        "position_sigma": 0.004,
        "heading_sigma": 0.001,
        "unexplained": 0.1,
    }


def _control(stamp: int, state: str, who: str, reason: str) -> dict[str, Any]:
    return {
        "header": {"stamp": _stamp(stamp), "frame_id": "base_link"},
        "state": state,
        "reason": reason,
        "controller": who,
        "armed": state == "armed",
        "estop": state == "estop",
        "command_age": 0.1,
        "linear": 0.0,
        "angular": 0.0,
    }


def _map_info(sha256: str) -> dict[str, Any]:
    return {"name": "plain", "frame_id": "map", "sha256": sha256, "points": 1, "min": {}, "max": {}}


def _recorded(display: Display, tmp_path: Path) -> Path:
    display.close()
    return tmp_path / "x.rrd"


# ---- a real drive


@pytest.mark.slow
def test_everything_of_a_real_drive_is_recorded(recording: Path) -> None:
    found = rows(recording)
    expected = [
        at.CLOUD,
        at.OVERHEAD,
        at.LIVE,
        at.LIVE_OVERHEAD,
        "map/odom",
        at.BASE,
        f"{at.BODY}/chassis",
        f"{at.BODY}/wheels",
        f"{at.BASE}/swing",
        f"{at.BASE}/laser_horizontal/housing",
        f"{at.BASE}/laser_vertical/housing",
        at.ESTIMATE_PATH,
        at.TRUTH_PATH,
        at.UNCERTAINTY,
        f"{at.HINT}/ghost/outline",
        f"{at.HINT}/window",
        f"{at.HINT}/move",
        at.LOG,
        at.LEGEND,
        *(f"{at.LANES}/{lane}" for lane in LANE_COLOURS),
        *(f"{at.PLOTS}/{series}" for series in SERIES),
    ]
    assert [entity for entity in expected if entity not in found] == []
    # Styles are one row; what moves has many more.
    for entity in (at.LIVE, at.UNCERTAINTY, at.ESTIMATE_PATH, f"{at.PLOTS}/position/error"):
        assert found[entity] > 50


def test_events_of_a_real_drive_are_logged_in_order(recording: Path) -> None:
    texts = [text for _, text in events(recording)]
    story = [
        "link up: ws://",
        "is the one shown here",
        "waiting: no pose yet",
        "hint sent: x ",
        "tracking",
        "hint accepted: ",
        "E-STOP: e-stop by test",
        "e-stop released",
    ]
    where = [next(i for i, text in enumerate(texts) if part in text) for part in story]
    assert len(set(where)) == len(story)
    assert len(texts) < 20


def test_error_plotted_is_the_distance_of_the_estimate_from_the_truth(recording: Path) -> None:
    errors = [
        value[0] for value in column(recording, f"{at.PLOTS}/position/error", "Scalars:scalars")
    ]
    assert len(errors) > 200
    assert 0.0 < np.median(errors) < 20.0


def test_path_ends_where_the_robot_is(recording: Path, moments: list[Moment]) -> None:
    strips = column(recording, at.ESTIMATE_PATH, "LineStrips3D:strips")
    end = np.array(strips[-1][0][-1])
    truth = next(
        message["pose"]["pose"]["position"]
        for topic, message in reversed(moments[-1].published + moments[-2].published)
        if topic == "/ground_truth/odom"
    )
    assert np.hypot(end[0] - truth["x"], end[1] - truth["y"]) < 0.1


def test_robot_is_not_drawn_before_it_is_localised(
    cloud: Cloud, moments: list[Moment], tmp_path: Path
) -> None:
    display = Display(cloud, sink=Sink(file=tmp_path / "x.rrd"), strict=True)
    play((m for m in moments if m.stamp < SECOND), display)
    display.close()
    found = rows(tmp_path / "x.rrd")
    assert at.BASE in found
    assert f"{at.BODY}/chassis" not in found


@pytest.mark.slow
def test_what_is_not_published_is_not_shown(
    cloud: Cloud, moments: list[Moment], tmp_path: Path
) -> None:
    """On a real robot there is no truth: neither a path of it nor an error."""
    display = Display(cloud, sink=Sink(file=tmp_path / "x.rrd"), strict=True)
    play(
        (
            replace(m, published=tuple(p for p in m.published if p[0] != "/ground_truth/odom"))
            for m in moments
        ),
        display,
    )
    display.close()
    assert column(tmp_path / "x.rrd", at.TRUTH_PATH, "LineStrips3D:strips") == []
    assert column(tmp_path / "x.rrd", f"{at.PLOTS}/position/error", "Scalars:scalars") == []


# ---- what a long drive costs


@pytest.mark.slow
def test_each_message_adds_one_piece_to_the_path(cloud: Cloud, tmp_path: Path) -> None:
    """So a message costs the same after an hour; a whole path again would be 96 kB at the end."""
    path = tmp_path / "x.rrd"
    display = Display(cloud, sink=Sink(file=path), strict=True)
    for step in range(1000):
        display.show("/tf", _tf(step * 40_000_000, 0.06 * step))
    recording = _recorded(display, tmp_path)
    pieces = column(recording, at.ESTIMATE_PATH, "LineStrips3D:strips")
    assert len(pieces) == 999
    assert {len(strip) for piece in pieces for strip in piece} == {2}
    assert recording.stat().st_size < 1000 * 400


def test_second_half_of_a_drive_takes_no_more_bytes_than_the_first(
    office_cloud: Cloud, moments: list[Moment], tmp_path: Path
) -> None:
    path = tmp_path / "x.rrd"
    display = Display(office_cloud, sink=Sink(file=path), strict=True)
    moving = [m for m in moments if m.stamp > 2 * SECOND]
    sizes = []
    for half in ([], moving[: len(moving) // 2], moving[len(moving) // 2 :]):
        play(half, display)
        display.flush()
        sizes.append(path.stat().st_size)
    display.close()
    first, second = np.diff(sizes)
    assert second < 1.3 * first


def test_a_robot_at_rest_adds_nothing_to_its_path(display: Display, tmp_path: Path) -> None:
    for i in range(100):
        display.show("/tf", _tf(i * SECOND, 1.0 + 0.001 * (i % 2)))
    assert column(_recorded(display, tmp_path), at.ESTIMATE_PATH, "LineStrips3D:strips") == []


def test_jump_of_the_estimate_is_not_joined_by_a_line(display: Display, tmp_path: Path) -> None:
    for i, x in enumerate((0.0, 0.1, 2.0, 2.1)):
        display.show("/tf", _tf(i * SECOND, x))
    strips = column(_recorded(display, tmp_path), at.ESTIMATE_PATH, "LineStrips3D:strips")
    ends = [[round(float(point[0]), 3) for point in strip[0]] for strip in strips]
    assert ends == [[0.0, 0.1], [2.0, 2.1]]


# ---- map, hints, states


@pytest.mark.parametrize(
    ("sha256", "state", "level"),
    [("a" * 64, "verified", "INFO"), ("b" * 64, "other map", "ERROR")],
)
def test_map_is_compared_by_its_hash(
    display: Display, tmp_path: Path, sha256: str, state: str, level: str
) -> None:
    display.show("/map_info", _map_info(sha256))
    recording = _recorded(display, tmp_path)
    assert column(recording, "state/map", "StateChange:state") == [[state]]
    assert [e[0] for e in events(recording)] == [level]
    assert at.CLOUD in rows(recording)


def test_cloud_that_was_never_saved_cannot_be_verified(cloud: Cloud, tmp_path: Path) -> None:
    unsaved = Cloud(cloud.points, cloud.normals, name="plain")
    display = Display(unsaved, sink=Sink(file=tmp_path / "x.rrd"), strict=True)
    display.show("/map_info", _map_info("b" * 64))
    display.close()
    assert column(tmp_path / "x.rrd", "state/map", "StateChange:state") == [["unverified"]]


@pytest.mark.parametrize(
    ("verdict", "candidates", "arrow"),
    [("accepted", 1, True), ("kept", 1, True), ("ambiguous", 3, False), ("rejected", 0, False)],
)
def test_every_verdict_is_drawn(
    display: Display, tmp_path: Path, verdict: str, candidates: int, arrow: bool
) -> None:
    display.show("/localization/hint_verdict", _verdict(SECOND, verdict, candidates))
    recording = _recorded(display, tmp_path)
    found = rows(recording)
    assert f"{at.HINT}/ghost/outline" in found
    assert (f"{at.HINT}/move" in found) == arrow
    assert (f"{at.HINT}/candidates" in found) == (candidates > 0)
    ((level, text),) = events(recording)
    assert text.startswith(f"hint {verdict}: because")
    assert level == ("INFO" if arrow else "WARN")


def test_repeated_verdict_is_drawn_once(display: Display, tmp_path: Path) -> None:
    for _ in range(3):
        display.show("/localization/hint_verdict", _verdict(SECOND, "kept", 1))
    assert len(events(_recorded(display, tmp_path))) == 1


def test_the_ghost_goes_some_time_after_the_verdict(display: Display, tmp_path: Path) -> None:
    display.hint(Pose.planar(1.0, 1.0, 0.5), np.eye(6), SECOND)
    display.show("/localization/hint_verdict", _verdict(2 * SECOND, "accepted", 1))
    late = 2 * SECOND + HINT_SHOWN
    for now in (late - 1, late, late + 1):
        display.show("/clock", {"clock": _stamp(now)})
    cleared = column(_recorded(display, tmp_path), f"{at.HINT}/ghost/outline", "Clear:is_recursive")
    assert cleared == [[False]]


def test_only_changes_are_logged_as_events(display: Display, tmp_path: Path) -> None:
    stamps = iter(range(0, 100 * SECOND, SECOND))
    for state, who, reason in (
        ("idle", "", "nobody drives yet"),
        ("armed", "ann", "took the free lease"),
        ("armed", "ann", "driving"),
        ("disarmed", "ben", "taken over from ann"),
        ("estop", "", "e-stop by ann"),
        ("estop", "", "e-stop by ann"),
        ("idle", "", "e-stop reset by ann"),
    ):
        display.show("/teleop/state", _control(next(stamps), state, who, reason))
    for health, why in (("tracking", ()), ("lost", ("fit 10%",)), ("lost", ("fit 9%",))):
        display.show("/localization/status", _status(next(stamps), health, *why))
    display.link(connected=False, text="no pong for 2 s", stamp=next(stamps))
    display.link(connected=True, text="after 3 s", stamp=next(stamps))
    assert events(_recorded(display, tmp_path)) == [
        ("INFO", "ann drives now: took the free lease"),
        ("INFO", "ben drives now: taken over from ann"),
        ("ERROR", "E-STOP: e-stop by ann"),
        ("INFO", "e-stop released: e-stop reset by ann"),
        ("INFO", "tracking"),
        ("ERROR", "lost: fit 10%"),
        ("ERROR", "link LOST: no pong for 2 s"),
        ("INFO", "link up: after 3 s"),
    ]


def test_a_released_deadman_asks_for_no_speed(display: Display, tmp_path: Path) -> None:
    display.command(0.5, 0.1, True, SECOND)
    display.command(0.5, 0.1, False, 2 * SECOND)
    recording = _recorded(display, tmp_path)
    speeds = column(recording, f"{at.PLOTS}/speed/stick", "Scalars:scalars")
    assert speeds == [[0.5], [0.0]]
    lane = column(recording, "state/deadman", "StateChange:state")
    assert lane == [["held"], ["released"]]


def test_uncertainty_is_the_95_percent_ellipse(display: Display, tmp_path: Path) -> None:
    covariance = np.zeros((6, 6))
    covariance[:2, :2] = [[0.04, 0.0], [0.0, 0.01]]
    covariance[5, 5] = 0.1**2
    message = {
        "header": {"stamp": _stamp(0), "frame_id": "map"},
        "pose": {"pose": _pose(1.0, 2.0), "covariance": covariance.ravel()},
    }
    display.show("/amcl_pose", message)
    ((ellipse, wedge),) = column(
        _recorded(display, tmp_path), at.UNCERTAINTY, "LineStrips3D:strips"
    )
    extent = np.ptp(np.array(ellipse), axis=0)
    assert extent[:2] / 2 == pytest.approx([2.448 * 0.2, 2.448 * 0.1], rel=0.01)
    assert np.mean(ellipse[:-1], axis=0)[:2] == pytest.approx([1.0, 2.0], abs=1e-6)
    left = np.array(wedge[2]) - np.array(wedge[1])
    assert np.arctan2(left[1], left[0]) == pytest.approx(0.196, abs=1e-3)


# ---- what goes wrong


def test_stamps_out_of_order_or_missing_do_no_harm(display: Display, moments: list[Moment]) -> None:
    published = [p for moment in moments[:200] for p in moment.published]
    for topic, message in reversed(published):
        display.show(topic, message)
        display.show(topic, {k: v for k, v in message.items() if k != "header"})
    assert not display.failures


def test_what_cannot_be_shown_is_counted_and_said_once(
    cloud: Cloud, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    display = Display(cloud, sink=Sink(file=tmp_path / "x.rrd"))
    bad: tuple[dict[str, Any], ...] = (
        {},
        {"transforms": [{}]},
        {"transforms": None},
        {"transforms": _tf(0, float("nan"))["transforms"]},
    )
    with caplog.at_level(logging.WARNING):
        for message in bad:
            display.show("/tf", message)
        for topic in display.topics:
            display.show(topic, {"header": {"stamp": {"sec": "soon"}}})
            display.show(topic, {"header": None})
        display.command(float("nan"), 0.0, True, -5)
        display.hint(Pose.identity(), np.zeros(3), 0)
    assert display.failures["/tf"] >= len(bad)
    assert display.failures["hint"] == 1
    assert len([r for r in caplog.records if " /tf " in r.getMessage()]) == 1
    display.show("/tf", _tf(SECOND, 1.0))
    display.close()
    assert f"{at.BODY}/chassis" in rows(tmp_path / "x.rrd")


def test_strict_display_raises(display: Display) -> None:
    with pytest.raises(KeyError):
        display.show("/tf", {})


def test_a_topic_it_does_not_know_is_left_aside(display: Display) -> None:
    display.show("/imu/data", {"what": "ever"})
    assert "/imu/data" not in display.topics


def test_frame_unconnected_to_the_map_is_ignored(display: Display, tmp_path: Path) -> None:
    message = _tf(0, 1.0)
    message["transforms"][0]["header"]["frame_id"] = "mars"
    display.show("/tf", message)
    assert "map/odom" not in rows(_recorded(display, tmp_path))


def test_a_large_map_is_thinned_and_its_ceiling_kept_apart(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform((0, 0, 0), (50, 50, 3), (300_000, 3))
    cloud = Cloud(points, np.tile([0.0, 0.0, 1.0], (len(points), 1)), name="large")
    Display(cloud, sink=Sink(file=tmp_path / "x.rrd"), strict=True).close()
    (low,) = column(tmp_path / "x.rrd", at.CLOUD, "Points3D:positions")
    (high,) = column(tmp_path / "x.rrd", at.OVERHEAD, "Points3D:positions")
    assert 90_000 < len(low) + len(high) <= 120_000
    assert max(p[2] for p in low) < min(p[2] for p in high)


# ---- places that a search found


def test_candidates_are_drawn_while_there_are_any_and_removed_once(
    display: Display, tmp_path: Path
) -> None:
    def found(stamp: int, count: int) -> dict[str, Any]:
        header = {"stamp": _stamp(stamp), "frame_id": "map"}
        return {"header": header, "poses": [_pose(float(i)) for i in range(count)]}

    for i, count in enumerate((0, 3, 2, 0, 0)):
        display.show("/localization/candidates", found((i + 1) * SECOND, count))
    assert rows(_recorded(display, tmp_path))[at.HYPOTHESES] == 3
