"""Another run of the robot, stale sources, the link in words, and alarms."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from localization.display import entity_paths as at
from localization.display.rerun_sink import Sink
from localization.geometry import quaternion_from_rotation, rotation_from_euler
from localization.maps.cloud import Cloud
from localization.types import SECOND
from teleop.operator.display.banner_picture import HEIGHT, WIDTH, draw_banner
from teleop.operator.display.display import Display
from teleop.operator.display.restarting_display import RestartingDisplay, recording_of
from teleop.operator.operating_data import operating_data
from teleop.operator.robot_state.alarm_rules import Notice, Severity, alarms_of
from teleop.operator.robot_state.banner import Banner
from teleop.operator.robot_state.event_list import EventList
from teleop.operator.robot_state.link_words import plain_reason
from teleop.operator.robot_state.reported_facts import ReportedFacts
from teleop.operator.robot_state.robot_run import RobotRun
from teleop.operator.robot_state.source_ages import STALE, SourceAges
from teleop.operator.robot_state.station_view import StationView
from teleop.operator.words import age_words
from tests.teleop.operator.support import column, events, rows

_MS = 1_000_000
_TABLE = json.loads((Path(__file__).parents[1] / "alarm_cases.json").read_text(encoding="utf-8"))


def stamp(ns: int) -> dict[str, int]:
    return {"sec": ns // SECOND, "nanosec": ns % SECOND}


def clock(ns: int) -> dict[str, Any]:
    return {"clock": stamp(ns)}


def map_info(run_id: str = "", sha256: str = "a" * 64) -> dict[str, Any]:
    return {
        "name": "plain",
        "frame_id": "map",
        "sha256": sha256,
        "points": 1,
        "min": {"x": 0.0, "y": 0.0, "z": 0.0},
        "max": {"x": 4.0, "y": 4.0, "z": 2.5},
        "run_id": run_id,
    }


def link(parent: str, child: str, x: float, ns: int = 0) -> dict[str, Any]:
    return {
        "header": {"stamp": stamp(ns), "frame_id": parent},
        "child_frame_id": child,
        "transform": {
            "translation": {"x": x, "y": 0.0, "z": 0.2},
            "rotation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        },
    }


def tf(ns: int, *, placed: bool = True) -> dict[str, Any]:
    links = [link("odom", "base_link", 1.0, ns)]
    return {"transforms": [*([link("map", "odom", 0.0, ns)] if placed else []), *links]}


def scan(ns: int, frame: str = "laser_horizontal") -> dict[str, Any]:
    return {
        "header": {"stamp": stamp(ns), "frame_id": frame},
        "angle_min": -0.5,
        "angle_increment": 0.5,
        "range_min": 0.1,
        "range_max": 10.0,
        "ranges": np.array([2.0, 3.0, 11.0]),  # the last one without return
    }


def status(ns: int, health: str = "tracking") -> dict[str, Any]:
    return {
        "header": {"stamp": stamp(ns), "frame_id": "map"},
        "health": health,
        "reasons": [],
        "fit": 0.9,
        "nis": 1.0,
        "position_sigma": 0.004,
    }


def control(state: str = "idle", reason: str = "", who: str = "") -> dict[str, Any]:
    return {
        "header": {"stamp": stamp(0), "frame_id": ""},
        "state": state,
        "reason": reason,
        "controller": who,
        "estop": state == "estop",
        "linear": 0.0,
        "angular": 0.0,
    }


# ---- runs


def test_another_identity_or_another_map_is_another_run() -> None:
    run, anew = RobotRun().after("/map_info", map_info("a1"))
    assert not anew
    run, anew = run.after("/clock", clock(100 * SECOND))
    assert not anew
    assert run.after("/map_info", map_info("a1"))[1] is False  # latched, on a new connection
    other, anew = run.after("/map_info", map_info("b2"))
    assert anew
    # Its clock begins at zero, which is no third run.
    assert other.after("/clock", clock(SECOND))[1] is False
    assert run.after("/map_info", map_info("a1", "b" * 64))[1] is True


def test_clock_that_goes_back_is_another_run_also_without_an_identity() -> None:
    run, _ = RobotRun().after("/clock", clock(100 * SECOND))
    assert run.after("/clock", clock(99_500 * _MS))[1] is False  # a late message
    after, anew = run.after("/clock", clock(2 * SECOND))
    assert anew
    assert after.after("/clock", clock(3 * SECOND))[1] is False
    # The identity of the run that began comes later, and belongs to it.
    named = RobotRun("a1", 100 * SECOND, "a" * 64).after("/clock", clock(0))[0]
    assert named.after("/map_info", map_info("b2"))[1] is False


def test_display_of_another_run_is_another_recording(cloud: Cloud, tmp_path: Path) -> None:
    file = tmp_path / "drive.rrd"

    def make(run: int) -> Display:
        return Display(None, sink=Sink(file=recording_of(file, run)), strict=True, live=True)

    display = RestartingDisplay(make)
    for run_id, ends in (("a1", (10, 20)), ("b2", (0, 5))):
        display.link(connected=True, text="ws://robot", stamp=0)
        display.show("/map_info", map_info(run_id))
        display.map(cloud)
        for seconds in range(*ends):
            display.show("/clock", clock(seconds * SECOND))
            display.show("/tf", tf(seconds * SECOND))
            display.show(
                "/odom",
                {
                    "header": {"stamp": stamp(seconds * SECOND)},
                    "twist": {"twist": {"linear": {"x": 0.1}}},
                },
            )
        display.link(connected=False, text="gone", stamp=0)
    display.close()
    assert display.runs == 2
    second = tmp_path / "drive-2.rrd"
    speeds = [
        len(column(f, f"{at.PLOTS}/speed/measured", "Scalars:scalars")) for f in (file, second)
    ]
    assert speeds == [10, 5]
    assert at.CLOUD in rows(second)
    assert column(second, "state/map", "StateChange:state")[-1] == ["verified"]
    # A file that is there is kept.
    assert recording_of(file, 2) == tmp_path / "drive-3.rrd"


def test_map_of_another_hash_is_never_drawn(cloud: Cloud, tmp_path: Path) -> None:
    display = Display(None, sink=Sink(file=tmp_path / "x.rrd"), strict=True, live=True)
    display.show("/map_info", map_info(sha256="b" * 64))
    display.map(cloud)
    display.close()
    assert at.CLOUD not in rows(tmp_path / "x.rrd")


# ---- stale


def _pulsed(view: StationView, display: Display, now: int) -> None:
    display.pulse(view.pulse(now))


def test_silence_greys_the_robot_and_the_lanes_and_comes_back(cloud: Cloud, tmp_path: Path) -> None:
    view = StationView(EventList())
    display = Display(None, sink=Sink(file=tmp_path / "x.rrd"), strict=True, live=True)

    def receive(topic: str, message: dict[str, Any], now: int) -> None:
        view.received(topic, message, now)
        display.show(topic, message)

    view.connection(True, "ws://robot", 0)
    for now in (0, 100 * _MS, 5000 * _MS):
        receive("/clock", clock(now), now)
        receive("/tf", tf(now), now)
        receive("/localization/status", status(now), now)
        _pulsed(view, display, now)
        if now == 100 * _MS:
            view.asked(now)
            view.answered(now + _MS)
            for later in range(200, 5000, 100):
                _pulsed(view, display, later * _MS)
    display.close()
    health = column(tmp_path / "x.rrd", "state/health", "StateChange:state")
    assert health == [["tracking"], ["stale"], ["tracking"]]
    lane = column(tmp_path / "x.rrd", "state/link", "StateChange:state")
    assert [state for (state,) in lane] == ["connected", "silent", "connected"]
    body = column(tmp_path / "x.rrd", f"{at.BODY}/chassis", "Boxes3D:colors")
    assert len(body) == 3  # red, grey, red
    assert body[0] == body[2] != body[1]


def test_time_goes_on_a_little_in_silence_so_that_it_is_seen(tmp_path: Path) -> None:
    display = Display(None, sink=Sink(file=tmp_path / "x.rrd"), strict=True, live=True)
    view = StationView(EventList())
    view.connection(True, "x", 0)
    for topic, message in (("/clock", clock(0)), ("/localization/status", status(0))):
        view.received(topic, message, 0)
        display.show(topic, message)
    for now in range(0, 60 * SECOND, SECOND // 2):
        _pulsed(view, display, now)
    # The robot's next message is earlier than that, and must be seen all the same.
    display.show("/localization/status", status(SECOND, "lost"))
    display.close()
    states = column(tmp_path / "x.rrd", "state/health", "StateChange:state")
    assert states[-1] == ["lost"]


def test_rates_and_ages_are_those_of_the_arrivals() -> None:
    ages = SourceAges()
    assert ages.age("/tf", 5) is None
    assert not ages.stale("/tf", 5)
    for k in range(101):
        ages.received("/tf", 40 * _MS * k)
    last = 4000 * _MS
    assert ages.rate("/tf", last + 10 * _MS) == pytest.approx(25.0, abs=0.6)
    assert not ages.stale("/tf", last + STALE)
    assert ages.stale("/tf", last + STALE + 1)
    assert ages.rate("/tf", last + SECOND) < 15.0
    assert ages.rate("/tf", last + 3 * SECOND) == 0.0
    assert ages.silence(last + 7) == 7
    assert STALE < SECOND // 2 - 50 * _MS


# ---- the link


def _view() -> StationView:
    view = StationView(EventList())
    view.connection(True, "ws://robot", 0)
    return view


def test_green_is_never_shown_over_silence() -> None:
    view = _view()
    view.received("/clock", clock(0), 0)
    view.received("/localization/status", status(0), 0)
    view.received("/tf", tf(0), 0)
    view.asked(10)
    view.answered(20)
    for now in range(0, 20 * SECOND, 50 * _MS):
        calm = {notice.severity for notice in (view.link(now), *view.notices(now))} == {
            Severity.CALM
        }
        assert calm is (now <= STALE), now


def test_link_loss_is_reported_within_a_second_in_plain_words() -> None:
    view = _view()
    view.received("/clock", clock(0), 0)
    view.asked(0)
    view.answered(10 * _MS)
    assert view.link(STALE).severity is Severity.CALM
    assert view.link(450 * _MS) == Notice(Severity.STALE, "Nothing received for 0.5 s")
    # Questions are asked every quarter of a second, the last one perhaps just before the link broke.
    view.asked(250 * _MS)
    told = view.link(600 * _MS)
    assert told.severity is Severity.ALARM
    assert told.text == "Nothing received for 0.6 s: what is shown is old."
    view.connection(
        False,
        "sent 1011 (internal error) keepalive ping timeout; no close frame received",
        5 * SECOND,
    )
    assert view.link(11 * SECOND).text == "No connection for 6.0 s. The robot stopped answering."
    assert (
        view.events.last(1)[0].text
        == "link lost: the robot stopped answering; the robot brakes by itself"
    )
    view.connection(True, "ws://robot", 19 * SECOND)
    assert view.link(19 * SECOND + STALE).severity is Severity.STALE  # what came before is old
    view.received("/clock", clock(0), 19 * SECOND)
    assert view.link(19 * SECOND).severity is Severity.CALM


def test_robot_in_lockstep_that_stands_still_is_no_lost_link() -> None:
    view = _view()
    view.received("/clock", clock(0), 0)
    for now in range(0, 10 * SECOND, 500 * _MS):
        view.asked(now)
        view.answered(now + 2 * _MS)
    told = view.link(10 * SECOND)
    assert told.severity is Severity.WARNING
    assert "though the robot's server answers" in told.text


def test_slow_link_is_no_lost_one_while_messages_come() -> None:
    view = _view()
    view.asked(0)
    for now in range(0, 3 * SECOND, 100 * _MS):
        view.received("/clock", clock(now), now)
    assert view.link(150 * _MS) == Notice(Severity.CALM, "Link: good")
    assert view.link(2900 * _MS).text == "The link is bad: round trip 2900 ms"
    view.answered(3 * SECOND)
    assert view.figures(3 * SECOND)[0] == "round trip 3000 ms"


@pytest.mark.parametrize(
    ("guard", "severity"), [("slowed", Severity.INFO), ("stopped", Severity.WARNING)]
)
def test_station_says_what_the_guard_does_until_that_is_old(guard: str, severity: Severity) -> None:
    view, words = _view(), "0.3 m/s: obstacle 0.9 m ahead"
    state = control("armed") | {"guard": guard, "guard_reason": words}
    view.received("/teleop/state", state, 0)
    said = Notice(severity, f"Guard: {words}")
    assert said in view.notices(100 * _MS)
    assert said not in view.notices(2 * SECOND)
    view.received("/teleop/state", state | {"guard": "free", "guard_reason": ""}, 3 * SECOND)
    assert said not in view.notices(3 * SECOND)


def test_station_that_never_connected_has_lost_nothing() -> None:
    assert StationView(EventList()).link(9 * SECOND) == Notice(Severity.STALE, "Not connected yet")


@pytest.mark.parametrize(
    ("age", "slow", "refuse", "words"),
    [
        (0.4, 0.5, 1.0, None),
        (0.7, 0.5, 1.0, "Commands arrive 0.7 s late: the robot drives slower."),
        (1.2, 0.5, 1.0, "Commands arrive 1.2 s late: the robot refuses them."),
        (1.2, 0.0, 0.0, None),  # both switched off
    ],
)
def test_old_commands_are_reported_with_what_the_robot_does(
    age: float, slow: float, refuse: float, words: str | None
) -> None:
    view = _view()
    ages = {"link_age": age, "slow_above": slow, "refuse_above": refuse}
    view.received("/teleop/state", {**control("armed", "driving", "ann"), **ages}, 0)
    told = [notice.text for notice in view.notices(1) if notice.text.startswith("Commands")]
    assert told == ([] if words is None else [words])


@pytest.mark.parametrize(
    ("reason", "words"),
    [
        ("the server closed the connection: code None", "the connection broke off"),
        (
            "the server closed the connection: the server is shutting down",
            "the robot's server was shut down",
        ),
        ("no close frame received or sent", "the connection broke off"),
        *(
            (f"no server listens at ws://{x}: Connection refused",) * 2
            for x in ("x", "robot:10080", "robot:11012")
        ),
        ("received 1008 (policy violation) barred", "the robot's server refused this station"),
        ("", "the connection broke off"),
    ],
)
def test_reasons_are_words(reason: str, words: str) -> None:
    assert plain_reason(reason) == words


def test_ages_are_words() -> None:
    ages = (0.64, 9.9, 12.4, 99.0, 180.0, 7200.0)
    said = [age_words(age) for age in ages]
    assert said == ["0.6 s", "9.9 s", "12 s", "99 s", "3 min", "2 h"]


# ---- alarms


def _imu(roll: float, pitch: float, covariance: float = 0.01) -> dict[str, Any]:
    w, x, y, z = quaternion_from_rotation(rotation_from_euler(roll, pitch, 1.0))
    return {
        "orientation": {"w": w, "x": x, "y": y, "z": z},
        "orientation_covariance": [covariance] + [0.0] * 8,
    }


def _drive(level: int, message: str) -> dict[str, Any]:
    return {
        "status": [
            {"level": 0, "name": "localization", "message": "x"},
            {"level": level, "name": "drive", "message": message},
        ]
    }


@pytest.mark.parametrize("case", _TABLE["cases"], ids=lambda case: str(case["name"]))
def test_alarms_are_those_of_the_table_that_the_page_follows_too(case: dict[str, Any]) -> None:
    found = alarms_of({**_TABLE["well"], **case["facts"]}, case.get("active", ()))
    assert [[a.severity.name.lower(), a.kind, a.text] for a in found] == case["alarms"]


def test_rules_of_alarms_are_followed_to_the_letter() -> None:
    """No rule has a field that neither program reads, or a severity that does not exist."""
    for rule in operating_data("alarms")["rules"]:
        assert rule.keys() <= {"kind", "group", "severity", "repeat", "when", "words", "why"}
        assert rule["severity"] in ("alarm", "warning", "info")
        for condition in rule["when"]:
            assert condition.keys() <= {"fact", "is", "above", "ends", "below"}


def test_estop_collision_stall_fall_and_tilt_are_facts_that_end() -> None:
    reported = ReportedFacts()
    for topic, message in (
        ("/imu/data", _imu(0.0, np.deg2rad(12.0))),
        ("/diagnostics", _drive(1, "left motors stalled; bumped in front")),
        (
            "/bumper_state",
            {"front_bumpers": [True, True, False, False, False], "rear_bumpers": [False] * 5},
        ),
        ("/teleop/state", control("estop", "e-stop by ann")),
    ):
        reported = reported.after(topic, message, 0)
    assert [alarm.text for alarm in alarms_of(reported.facts(1))] == [
        "E-stop (pressed by ann)",
        "Collision in front, left",
        "Drive: left motors stalled",
        "Tilted by 12°, nose down",
    ]
    for topic, message in (
        ("/imu/data", _imu(0.0, np.deg2rad(2.0))),
        ("/diagnostics", _drive(0, "ok")),
        ("/bumper_state", {"front_bumpers": [False] * 5, "rear_bumpers": [False] * 5}),
        ("/teleop/state", control()),
    ):
        reported = reported.after(topic, message, SECOND)
    held = alarms_of(reported.facts(2 * SECOND - 1))
    assert [alarm.text for alarm in held] == ["Collision in front, left"]
    assert alarms_of(reported.facts(2 * SECOND)) == ()
    fallen = reported.after("/diagnostics", _drive(2, "fallen"), 0)
    assert [alarm.kind for alarm in alarms_of(fallen.facts(9 * SECOND))] == ["fallen"]


def _seen(asked: float, speed: float, seconds: float) -> list[str]:
    """Return the alarms after a robot that was asked for one speed [m/s] has moved with another."""
    reported = ReportedFacts().after("/teleop/state", control("armed") | {"linear": asked}, 0)
    for ns in range(0, round(seconds * SECOND) + 1, 100 * _MS):
        moved = {
            "transforms": [link("map", "odom", 0.0), link("odom", "base_link", speed * ns / SECOND)]
        }
        reported = reported.after("/tf", moved, ns)
    return [alarm.kind for alarm in alarms_of(reported.facts(round(seconds * SECOND)))]


@pytest.mark.parametrize(
    ("asked", "speed", "seconds", "kinds"),
    [
        (0.5, 0.0, 2.0, ["blocked"]),
        (0.5, 0.0, 1.4, []),
        (0.5, 0.4, 9.0, []),
        (0.0, 0.0, 9.0, []),
    ],
    ids=["stands", "begins", "moves", "rests"],
)
def test_robot_that_stands_though_it_is_asked_to_move_is_blocked(
    asked: float, speed: float, seconds: float, kinds: list[str]
) -> None:
    assert _seen(asked, speed, seconds) == kinds


def test_robot_whose_poses_are_old_or_that_is_not_placed_is_not_called_blocked() -> None:
    reported = ReportedFacts().after("/teleop/state", control("armed") | {"linear": 0.5}, 0)
    for ns in range(0, 2 * SECOND + 1, 100 * _MS):
        reported = reported.after("/tf", tf(ns), ns)
    assert reported.facts(2 * SECOND)["blocked"] == pytest.approx(1.8)
    assert reported.facts(2 * SECOND + STALE + 1)["blocked"] is None
    assert (
        reported.after("/tf", tf(0, placed=False), 2 * SECOND).facts(2 * SECOND)["blocked"] is None
    )


@pytest.mark.parametrize(
    ("roll", "pitch", "words"),
    [(0.3, 0.0, "to the right"), (-0.3, 0.0, "to the left"), (0.0, -0.3, "nose up")],
)
def test_tilt_says_which_way(roll: float, pitch: float, words: str) -> None:
    facts = ReportedFacts().after("/imu/data", _imu(roll, pitch), 0).facts(0)
    assert facts["tilt"] == pytest.approx(np.rad2deg(0.3))
    assert facts["tilt_direction"] == words


@pytest.mark.parametrize(
    "message",
    [
        _imu(0.5, 0.5, -1.0),
        {
            "orientation": {"w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0},
            "orientation_covariance": [0.0] * 9,
        },
        {
            "orientation": {"w": 0.0, "x": 0.0, "y": 0.0, "z": 0.0},
            "orientation_covariance": [0.0] * 9,
        },
    ],
)
def test_unit_that_knows_no_orientation_gives_no_tilt(message: dict[str, Any]) -> None:
    assert ReportedFacts().after("/imu/data", message, 0).tilt is None


def test_new_alarms_are_events_once() -> None:
    view = _view()
    for k in range(20):
        view.received("/teleop/state", control("estop", "e-stop by ann"), k)
        view.received("/bumper_state", {"front_bumpers": [False], "rear_bumpers": [True]}, k)
    view.received("/teleop/state", control("idle", "e-stop reset by ann"), 30)
    assert [str(e) for e in view.events.last(9)][1:] == [
        "E-stop (pressed by ann)",
        "Collision behind",
        "e-stop released: e-stop reset by ann",
    ]


def test_repeated_events_are_counted_and_said_once() -> None:
    said: list[str] = []
    events_ = EventList(said.append)
    for k in range(28):
        events_.add("warning: send a neutral stick first")
        if k == 3:
            events_.add("health: slipping")
    assert said == ["warning: send a neutral stick first", "health: slipping"]
    assert str(events_.repeated[0]) == "warning: send a neutral stick first   (28 times)"


def test_banner_is_red_for_an_alarm_and_grey_for_what_is_stale() -> None:
    import io

    from PIL import Image

    long = "a reason that is much longer than what fits into a line of the banner, " * 4
    notices = (Notice(Severity.ALARM, "E-stop: by ann"), Notice(Severity.WARNING, long))
    banner = Banner(
        Notice(Severity.STALE, "Nothing received for 0.6 s"), notices, ("a", "b", "c", "d")
    )
    picture = np.asarray(Image.open(io.BytesIO(draw_banner(banner))))
    assert picture.shape == (HEIGHT, WIDTH, 3)
    assert tuple(picture[2, 2]) == (95, 95, 100)
    assert tuple(picture[2, 900]) == (226, 50, 40)


# ---- without a pose


def test_scan_is_drawn_around_a_robot_without_a_pose_and_goes_with_the_first_sweep(
    tmp_path: Path,
) -> None:
    display = Display(None, sink=Sink(file=tmp_path / "x.rrd"), strict=True, live=True)
    static = {"transforms": [link("base_link", "laser_horizontal", 0.1)]}
    display.show("/tf_static", static)
    for ns in range(0, SECOND, 100 * _MS):
        display.show("/tf", tf(ns, placed=False))
        display.show("/scan", scan(ns))
    display.show("/tf", tf(SECOND))
    cloud = np.zeros(2, dtype=[("x", "<f4"), ("y", "<f4"), ("z", "<f4")])
    sweep = {
        "header": {"stamp": stamp(SECOND), "frame_id": "map"},
        "width": 2,
        "height": 1,
        "point_step": 12,
        "is_bigendian": False,
        "data": cloud.tobytes(),
        "fields": [
            {"name": n, "offset": 4 * i, "datatype": 7, "count": 1} for i, n in enumerate("xyz")
        ],
    }
    display.show("/local_cloud", sweep)
    display.show("/scan", scan(SECOND + 100 * _MS))  # there is a sweep in the map: not drawn
    display.show("/scan", scan(SECOND + 700 * _MS))  # and now there is none any more
    display.close()
    entity = f"{at.SCANS}/laser_horizontal"
    drawn = column(tmp_path / "x.rrd", entity, "Points3D:positions")
    assert len(drawn) == 11
    ahead = [point for point in drawn[0] if abs(point[1]) < 1e-6]
    assert ahead == [pytest.approx([3.1, 0.0, 0.2], abs=1e-6)]
    assert len(drawn[0]) == 2  # the beam without return has no point
    assert column(tmp_path / "x.rrd", entity, "Clear:is_recursive") == [[False]]
    # The robot itself is drawn, far from where a map could be.
    place = column(tmp_path / "x.rrd", "map/odom", "Transform3D:translation")
    assert place[0][0][1] < -1000.0
    assert f"{at.BODY}/chassis" in rows(tmp_path / "x.rrd")
    assert not [text for _, text in events(tmp_path / "x.rrd") if "cannot" in text]
