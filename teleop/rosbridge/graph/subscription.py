"""A client's subscription to a topic: merged options, throttling, and the held-back message."""

from __future__ import annotations

from dataclasses import dataclass, field

from teleop.rosbridge.framing.outgoing_frames import FrameKind, MessageTally, OutgoingFrame
from teleop.rosbridge.graph.publication import ENCODINGS, Encoding, Publication
from teleop.rosbridge.messages.ros_serialization import RosVersion
from teleop.rosbridge.ros_time import MILLISECOND
from teleop.rosbridge.timers import Timer


@dataclass(frozen=True, slots=True)
class SubscribeOptions:
    """Options of one ``subscribe`` operation, of which a client may send several per topic."""

    throttle: int = 0
    """Shortest time between two messages [ms]."""

    depth: int = 0
    """``queue_length``: number of messages that may be queued; 0 leaves it to the queue's size."""

    keep_all: bool = False
    """Whether it wants every message, also those that newer ones have overtaken (history ``keep_all``)."""

    encoding: Encoding = "none"

    fragment: int = 0
    """Largest fragment of a message [bytes]; 0 for unfragmented messages."""

    ros_version: RosVersion = "ros2"
    """The ROS whose serialisation ``cbor-raw`` contains."""


@dataclass(slots=True)
class Subscription:
    """A client's subscription, which merges all its ``subscribe`` operations: one message for all."""

    topic: str
    """Name as the client spells it, which is repeated byte for byte in its messages."""

    options: dict[object, SubscribeOptions] = field(default_factory=dict)
    """Options by the ids of the ``subscribe`` operations."""

    timer: Timer | None = None
    """Timer of the held-back message."""

    tally: MessageTally = field(default_factory=MessageTally)
    """Counts its messages."""

    _merged: SubscribeOptions = field(default_factory=SubscribeOptions)
    _sent: int | None = None
    _held: Publication | None = None

    def merge(self) -> None:
        """Merge the options: shortest times, queue and fragments, highest-priority encoding."""
        options = self.options.values()
        self._merged = SubscribeOptions(
            min(o.throttle for o in options) * MILLISECOND,
            min(o.depth for o in options),
            any(o.keep_all for o in options),
            max((o.encoding for o in options), key=ENCODINGS.index),
            min((o.fragment for o in options if o.fragment), default=0),
            next(reversed(options)).ros_version,
        )

    @property
    def variant(self) -> tuple[str, Encoding, RosVersion]:
        """Topic, encoding and serialisation of its frames."""
        return self.topic, self._merged.encoding, self._merged.ros_version

    @property
    def due(self) -> int | None:
        """Time at which the held-back message may be sent [ns]; None without one."""
        if self._held is None or self._sent is None:
            return None
        return self._sent + self._merged.throttle

    def offer(self, publication: Publication, now: int) -> OutgoingFrame | None:
        """Return the frame to send now, or hold the message back until ``due``.

        The last message of a burst is always delivered, if late: a subscriber that throttles
        joystick positions must not miss the return to zero.
        """
        if self._sent is not None and now < self._sent + self._merged.throttle:
            self._held = publication
            return None
        return self._frame(publication, now)

    def release(self, now: int) -> OutgoingFrame | None:
        """Return the frame of the held-back message if it is due."""
        if self._held is None or self.due is None or now < self.due:
            return None
        return self._frame(self._held, now)

    def cancel(self) -> None:
        """Cancel the timer of the held-back message."""
        if self.timer is not None:
            self.timer.cancel()
            self.timer = None

    def _frame(self, publication: Publication, now: int) -> OutgoingFrame:
        merged = self._merged
        newest = publication.newest and not merged.keep_all and not merged.depth
        thin = newest and publication.thin is not None
        payload = publication.frame(*self.variant, self.tally.detail.level if thin else 0)
        self._sent = now
        self._held = None
        binary = merged.encoding in ("cbor", "cbor-raw")
        return OutgoingFrame(
            FrameKind.DATA,
            payload,
            binary,
            topic=self.topic,
            depth=merged.depth,
            newest=newest,
            thinned=thin,
            captured=publication.captured,
            fragment=0 if binary else merged.fragment,
            tally=self.tally,
        )
