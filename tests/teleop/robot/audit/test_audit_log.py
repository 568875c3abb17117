"""Rate limits of the audit log: a flood fills no disk, and suppressed lines are counted."""

from __future__ import annotations

import json
from collections import Counter
from typing import Any

from hypothesis import given, strategies as st

from teleop.robot.audit.audit_log import SUPPRESSED, AuditLog
from teleop.robot.audit.audit_rate_limit import LINE_RATES, AuditRateLimiter
from teleop.rosbridge import ClientLimits, Protocol, Server
from tests.teleop.rosbridge.support import REGISTRY, SECOND

KINDS = (*LINE_RATES, "drive")


class Rig:
    """An audit of clients without sockets."""

    def __init__(self, limits: ClientLimits | None = None) -> None:
        self.lines: list[dict[str, Any]] = []
        self.now = 0
        self.protocol = Protocol(REGISTRY, limits=limits)
        self.protocol.topics.advertise("/odom", "nav_msgs/Odometry")
        server = Server(self.protocol, clock=lambda: self.now)
        self.audit = AuditLog(
            self.lines.append, server, stamp=lambda: self.now, wall=lambda: "noon"
        )

    def logged(self, what: str) -> list[dict[str, Any]]:
        return [line for line in self.lines if line["what"] == what]

    def suppressed(self, kind: str) -> int:
        lines = [line["lines"] for line in self.logged(SUPPRESSED)]
        return sum(counts.get(kind, 0) for line in lines for counts in line.values())


def test_repeated_attempts_are_logged_once_a_second_and_counted() -> None:
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
    own = [line for line in rig.logged("refused") if "10.0.0.6" in line["client"]]
    assert 70 < len(own) < 90  # a burst of 20, and then one a second
    assert len(own) + rig.suppressed("refused") == 18_000
    assert len(rig.logged(SUPPRESSED)) <= 61
    assert len(rig.logged("refused")) == len(own) + 1  # the other's is among them


def test_excessive_rate_is_logged_once_and_when_it_ends_the_connection() -> None:
    rig = Rig(ClientLimits(messages=10, burst=1))
    client = rig.protocol.connect(0, "10.0.0.6:1")
    for _ in range(100):
        rig.protocol.receive(client, '{"op":"set_level","level":"error"}', 0)
    assert [line["refused"] for line in rig.logged("refused")] == [
        "rate limit of 10 operations/s exceeded",
        "rate limit of 10 operations/s exceeded: disconnected",
    ]
    large = rig.protocol.connect(0, "10.0.0.7:1")
    rig.protocol.receive(large, " " * 1_000_001, 0)
    assert rig.logged("refused")[-1]["refused"] == "a frame may have at most 1000000 bytes"


def test_refused_viewers_of_ever_new_addresses_fill_neither_disk_nor_memory() -> None:
    rig = Rig()
    for number in range(6000):
        rig.now = number * SECOND // 100
        rig.audit.viewer_refused(
            f"10.0.{number // 250}.{number % 250}", None, "/stream", "no token"
        )
    rig.audit.end()
    lines = rig.logged("viewer refused")
    assert 350 < len(lines) < 450  # a burst of 100, and then five a second
    assert len(lines) + rig.suppressed("viewer refused") == 6000
    assert lines[0]["client"] == "10.0.0.0"
    assert (lines[0]["path"], lines[0]["refused"]) == ("/stream", "no token")
    assert len(rig.audit._rates._own) <= 300


def test_line_about_a_rejected_operation_is_short_for_any_operation() -> None:
    rig = Rig(ClientLimits.unhurried())
    client = rig.protocol.connect(0, "10.0.0.6:1")
    for key in ("op", "topic", "service", "action", "type", "msg", "id"):
        base = {"op": "publish", "topic": "/odom", "msg": {}}
        rig.protocol.receive(client, json.dumps({**base, key: "x" * 900_000}), 0)
        rig.protocol.receive(client, json.dumps({**base, key: {"deep": [1, 2]}}), 0)
    assert len(rig.logged("refused")) == 14
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
    limiter, now = AuditRateLimiter(), 0
    written: Counter[str] = Counter()
    counted: Counter[str] = Counter()
    for kind, client, wait, leaves in lines:
        now += wait
        written[kind] += limiter.take(kind, client, now)
        for counts in limiter.suppressed(now).values():
            counted.update(counts)
        if leaves:
            limiter.leave(client)
    for counts in limiter.suppressed(now, last=True).values():
        counted.update(counts)
    assert written + counted == Counter(kind for kind, *_ in lines)
    assert counted["drive"] == 0  # commands that move the robot are never suppressed


def test_wrong_tokens_leave_a_line_a_second_with_their_number_and_addresses() -> None:
    rig = Rig()
    for number in range(3000):
        rig.now = number * SECOND // 1000
        host = "10.0.0.6" if number % 2 else f"10.1.{number % 1000 // 250}.{number % 250}"
        rig.protocol.token_guesses.wrong(host, str(number), rig.now)
        if number % 5 == 0:
            rig.protocol.token_guesses.locked("10.0.0.6", "another", rig.now)
        rig.protocol.timers.tick(rig.now)
    rig.audit.end()
    lines = rig.logged("wrong tokens")
    assert 3 <= len(lines) <= 4
    counted = sum(line["guesses"] for line in lines)
    assert 3590 <= counted <= 3600, "those that are not even compared count too"
    assert all(len(line["addresses"]) <= 16 for line in lines)
    assert lines[1]["addresses"]["10.0.0.6"] >= 500
    assert not any("another" in str(line) for line in lines), "never the token itself"
