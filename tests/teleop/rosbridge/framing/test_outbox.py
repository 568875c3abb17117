from __future__ import annotations

from dataclasses import replace

from hypothesis import given, strategies as st

from teleop.rosbridge.framing.outbox import BULK_BYTES, Outbox, QueueLimits
from teleop.rosbridge.framing.outgoing_frames import (
    CloseFrame,
    FrameKind,
    MessageTally,
    OutgoingFrame,
)
from teleop.rosbridge.ros_time import SECOND


def data(text: str, topic: str = "/a", depth: int = 0, lossless: bool = False) -> OutgoingFrame:
    return OutgoingFrame(FrameKind.DATA, text.encode(), topic=topic, depth=depth, lossless=lossless)


def control(text: str, lossless: bool = False) -> OutgoingFrame:
    return OutgoingFrame(FrameKind.CONTROL, text.encode(), lossless=lossless)


def contents(outbox: Outbox) -> list[str]:
    frames = []
    while frame := outbox.pop():
        frames.append(frame.payload.decode())
    assert (len(outbox), outbox.size) == (0, 0)
    return frames


def test_queue_length_limits_messages_of_a_topic() -> None:
    outbox = Outbox()
    for i in range(5):
        outbox.push(data(f"a{i}", "/a", depth=2))
        outbox.push(data(f"b{i}", "/b"))
    assert contents(outbox) == ["b0", "b1", "b2", "a3", "b3", "a4", "b4"]
    assert outbox.dropped == 3


def test_only_the_latest_bulk_message_of_a_topic_is_queued() -> None:
    outbox = Outbox()
    for i in range(5):
        outbox.push(data(str(i) * BULK_BYTES, depth=10))
    assert outbox.size == BULK_BYTES
    assert contents(outbox) == ["4" * BULK_BYTES]


def test_full_queue_drops_the_oldest_message() -> None:
    outbox = Outbox(QueueLimits(data=10))
    for text in ("aaaa", "bbbb", "cccc"):
        outbox.push(data(text))
    assert contents(outbox) == ["bbbb", "cccc"]
    outbox.push(data("larger than all of it"))
    assert contents(outbox) == ["larger than all of it"]


def test_too_many_unread_responses_disconnect() -> None:
    outbox = Outbox(QueueLimits(control=10))
    outbox.push(control("0123456789"))
    assert outbox.close is None
    outbox.push(control("x"))
    assert outbox.close == CloseFrame(1013, "send queue exceeds 10 bytes")
    outbox.push(control("y"))
    assert contents(outbox) == []


def test_lossless_clients_receive_all_frames_in_order() -> None:
    outbox = Outbox(QueueLimits(data=2))
    outbox.push(data("1", lossless=True, depth=1))
    outbox.push(data("2" * BULK_BYTES, lossless=True, depth=1))
    outbox.push(control("answer", lossless=True))
    outbox.push(data("3", lossless=True, depth=1))
    assert contents(outbox) == ["1", "2" * BULK_BYTES, "answer", "3"]


def test_frames_that_fit_together_leave_together_in_the_order_in_which_they_would_leave_alone() -> (
    None
):
    outbox = Outbox()
    for frame in (data("1234"), control("answer"), data("56"), data("too long"), data("7")):
        outbox.push(frame)
    assert [frame.text for frame in outbox.pop_small(12)] == ["answer", "1234", "56"]
    assert outbox.size == len("too long") + len("7")
    assert outbox.pop_small(7) == []
    assert contents(outbox) == ["too long", "7"]


def test_pings_and_fragments_do_not_leave_together_with_other_frames() -> None:
    ping = OutgoingFrame(FrameKind.PING, b"ping")
    fragmented = replace(control("answer"), fragment=2, fragment_id="1")
    for alone in (ping, fragmented):
        outbox = Outbox()
        outbox.push(alone)
        assert outbox.pop_small(100) == []
        assert outbox.pop() is alone


def test_cleared_queue_is_empty() -> None:
    outbox = Outbox()
    outbox.push(data("1"))
    outbox.push(control("a"))
    outbox.discard_data()
    assert contents(outbox) == ["a"]
    outbox.push(control("a"))
    outbox.clear()
    assert contents(outbox) == []


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["/a", "/b"]),
            st.integers(0, 40),
            st.integers(0, 3),
            st.sampled_from(["data", "control", "pop"]),
        )
    )
)
def test_queue_stays_within_limits_and_counts_correctly(
    pushes: list[tuple[str, int, int, str]],
) -> None:
    outbox = Outbox(QueueLimits(data=100, control=10**6))
    for number, (topic, size, depth, what) in enumerate(pushes):
        text = f"{number:06}" + "x" * size
        if what == "pop":
            outbox.pop()
        else:
            outbox.push(data(text, topic, depth) if what == "data" else control(text))
    frames = []
    while frame := outbox.pop():
        frames.append(frame)
    assert (len(outbox), outbox.size) == (0, 0)
    messages = [frame.payload for frame in frames if frame.kind is FrameKind.DATA]
    assert sum(map(len, messages)) <= 100
    assert messages == sorted(messages)
    assert [frame.kind for frame in frames] == sorted(
        (frame.kind for frame in frames), key=lambda kind: kind is FrameKind.DATA
    )


@given(
    st.lists(st.tuples(st.sampled_from("ab"), st.integers(1, 40), st.integers(0, 3)), max_size=60)
)
def test_tallies_and_bytes_are_those_of_the_frames_that_leave(
    given: list[tuple[str, int, int]],
) -> None:
    outbox = Outbox(QueueLimits(data=200))
    tallies = {topic: MessageTally() for topic in "ab"}
    for topic, size, depth in given:
        outbox.push(replace(data("x" * size, topic, depth), tally=tallies[topic]))
        outbox.push(control("response"))
    left = []
    while frame := outbox.pop():
        left.append(frame)
    for topic, tally in tallies.items():
        assert tally.sent == sum(frame.topic == topic for frame in left)
        assert tally.sent + tally.dropped == sum(name == topic for name, _, _ in given)
    assert outbox.accepted == sum(len(frame.payload) for frame in left)


def ping(number: int) -> OutgoingFrame:
    return OutgoingFrame(FrameKind.PING, f"rt{number}".encode())


def test_ping_waits_behind_the_messages_before_it() -> None:
    outbox = Outbox()
    for frame in (data("1"), ping(1), data("2"), control("a"), ping(2)):
        outbox.push(frame)
    assert contents(outbox) == ["a", "1", "rt1", "2", "rt2"]


class _Clock:
    """A clock that stands where it is set [s]."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def __call__(self) -> int:
        return round(self.seconds * SECOND)


def test_client_that_drives_gets_no_overtaken_message_after_half_a_second() -> None:
    clock = _Clock()
    outbox = Outbox(clock=clock)
    outbox.keep_fresh()
    for number in range(6):
        clock.seconds = 0.1 * number
        for frame in (data(f"a{number}", "/a"), data(f"b{number}", "/b"), ping(number)):
            outbox.push(frame)
    first = outbox.pop()
    assert first is not None
    assert first.payload == b"a0", "half a second is not too long"
    clock.seconds = 0.51
    outbox.push(control("answer"))
    assert contents(outbox) == ["answer", *(f"rt{n}" for n in range(5)), "a5", "b5", "rt5"]
    assert outbox.dropped == 9


def test_pings_that_wait_make_no_message_older() -> None:
    clock = _Clock()
    outbox = Outbox(clock=clock)
    outbox.keep_fresh()
    outbox.push(ping(1))
    clock.seconds = 0.4
    for number in range(3):
        outbox.push(data(str(number)))
    clock.seconds = 0.6
    assert contents(outbox) == ["rt1", "0", "1", "2"]


def test_only_message_of_a_topic_waits_for_as_long_as_it_takes() -> None:
    clock = _Clock()
    outbox = Outbox(clock=clock)
    outbox.keep_fresh()
    for frame in (data("map", "/map"), data("1"), data("2")):
        outbox.push(frame)
    clock.seconds = 60.0
    assert contents(outbox) == ["map", "2"]


def test_messages_queued_before_a_client_drives_count_as_old() -> None:
    clock = _Clock()
    outbox = Outbox(clock=clock)
    clock.seconds = 100.0
    for number in range(3):
        outbox.push(data(str(number)))
    clock.seconds = 100.6
    outbox.keep_fresh()
    assert contents(outbox) == ["2"]


def newest(text: str, topic: str = "/pose") -> OutgoingFrame:
    return replace(data(text, topic), newest=True)


def test_after_a_stall_a_client_gets_the_newest_pose_alone_and_all_other_messages() -> None:
    clock = _Clock()
    outbox = Outbox(clock=clock)
    for number in range(30):
        clock.seconds = 0.1 * number
        outbox.push(newest(f"pose {number}"))
        outbox.push(data(f"line {number}", "/rosout"))
    clock.seconds = 3.0
    left = contents(outbox)
    assert [text for text in left if text.startswith("pose")] == ["pose 29"]
    assert len(left) == 31


def test_to_a_client_that_drives_no_pose_is_sent_that_waited_for_more_than_half_a_second() -> None:
    clock = _Clock()
    outbox = Outbox(clock=clock)
    outbox.keep_fresh()
    outbox.push(newest("old"))
    outbox.push(data("map", "/map"))
    clock.seconds = 0.6
    assert contents(outbox) == ["map"]
    outbox.push(newest("new"))
    assert contents(outbox) == ["new"]
    outbox.push(newest("old again"))
    clock.seconds = 2.0
    assert outbox.pop() is None
    assert len(outbox) == 0
