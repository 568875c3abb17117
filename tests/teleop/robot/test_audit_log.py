"""A flood fills no disk: of what is too much, the audit log says how much it was."""

from __future__ import annotations

import json
from collections import Counter
from typing import Any

from hypothesis import given, strategies as st

from teleop.robot.audit_log import Audit
from teleop.robot.audit_rate_limit import RATIONS, Rations
from teleop.rosbridge import ClientLimits, Protocol, Server
from tests.teleop.rosbridge.support import REGISTRY, SECOND

KINDS = (*RATIONS, "drive")


class Rig:
    """An audit of clients without sockets."""

    def __init__(self, limits: ClientLimits | None = None) -> None:
        self.lines: list[dict[str, Any]] = []
        self.now = 0
        self.protocol = Protocol(REGISTRY, limits=limits)
        self.protocol.topics.advertise("/odom", "nav_msgs/Odometry")
        self.audit = Audit(
            self.lines.append, Server(self.protocol), stamp=lambda: self.now, wall=lambda: "noon"
        )

    def told(self, what: str) -> list[dict[str, Any]]:
        return [line for line in self.lines if line["what"] == what]

    def untold(self, kind: str) -> int:
        lines = [line["lines"] for line in self.told("not told")]
        return sum(counts.get(kind, 0) for line in lines for counts in line.values())


def test_who_tries_again_and_again_is_told_of_by_the_second_and_counted() -> None:
    rig = Rig(ClientLimits.unhurried())
    flood, other = rig.protocol.connect(0, "10.0.0.6:1"), rig.protocol.connect(0, "10.0.0.7:1")
    attempt = json.dumps({"op": "publish", "topic": "/odom", "msg": {}})
    for second in range(60):
        rig.now = second * SECOND
        for _ in range(300):
            rig.protocol.receive(flood, attempt, rig.now)
        if second == 30:
            rig.protocol.receive(other, attempt, rig.now)
    rig.audit.end()
    own = [line for line in rig.told("refused") if "10.0.0.6" in line["client"]]
    assert 70 < len(own) < 90  # a burst of 20, and then one a second
    assert len(own) + rig.untold("refused") == 18_000
    assert len(rig.told("not told")) <= 61
    assert len(rig.told("refused")) == len(own) + 1  # the other's is among them


def test_who_comes_and_goes_all_the_time_fills_no_disk_either() -> None:
    rig = Rig()
    for number in range(6000):
        rig.now = number * SECOND // 100
        rig.protocol.disconnect(rig.protocol.connect(rig.now), rig.now)
    rig.audit.end()
    for kind in ("connected", "disconnected"):
        assert 350 < len(rig.told(kind)) < 450  # a burst of 100, and then five a second
        assert len(rig.told(kind)) + rig.untold(kind) == 6000
    assert len(rig.lines) < 1000
    assert max(len(json.dumps(line)) for line in rig.lines) < 10_000


def test_too_much_is_told_once_and_when_it_ends_the_connection() -> None:
    rig = Rig(ClientLimits(messages=10, burst=1))
    client = rig.protocol.connect(0, "10.0.0.6:1")
    for _ in range(100):
        rig.protocol.receive(client, '{"op":"set_level","level":"error"}', 0)
    assert [line["refused"] for line in rig.told("refused")] == [
        "rate limit of 10 operations/s exceeded",
        "rate limit of 10 operations/s exceeded: disconnected",
    ]
    large = rig.protocol.connect(0, "10.0.0.7:1")
    rig.protocol.receive(large, " " * 1_000_001, 0)
    assert rig.told("refused")[-1]["refused"] == "a frame may have at most 1000000 bytes"


def test_a_record_of_what_was_refused_is_short_whatever_was_sent() -> None:
    rig = Rig(ClientLimits.unhurried())
    client = rig.protocol.connect(0, "10.0.0.6:1")
    for key in ("op", "topic", "service", "action", "type", "msg", "id"):
        base = {"op": "publish", "topic": "/odom", "msg": {}}
        rig.protocol.receive(client, json.dumps({**base, key: "x" * 900_000}), 0)
        rig.protocol.receive(client, json.dumps({**base, key: {"deep": [1, 2]}}), 0)
    assert len(rig.told("refused")) == 14
    assert max(len(json.dumps(line)) for line in rig.lines) < 1500


@given(
    st.lists(
        st.tuples(
            st.sampled_from(KINDS),
            st.sampled_from("abc"),
            st.integers(0, SECOND // 4),
            st.booleans(),
        ),
        max_size=300,
    )
)
def test_no_line_is_lost_uncounted(lines: list[tuple[str, str, int, bool]]) -> None:
    rations, now = Rations(), 0
    told: Counter[str] = Counter()
    counted: Counter[str] = Counter()
    for kind, client, wait, leaves in lines:
        now += wait
        told[kind] += rations.take(kind, client, now)
        for counts in rations.untold(now).values():
            counted.update(counts)
        if leaves:
            rations.leave(client)
    for counts in rations.untold(now, last=True).values():
        counted.update(counts)
    assert told + counted == Counter(kind for kind, *_ in lines)
    assert counted["drive"] == 0  # what moves the robot is told whole
