"""The service ``/localization/preview_hint``: what the last sweep says of a pose, answered by the estimator.

Of each client one request at a time is with the estimator, ten a second; of those that wait meanwhile only
the newest is kept, so that a client may ask with each movement of a hand. None remains without an answer.
"""

from __future__ import annotations

import itertools
import secrets
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

from localization.logs.ros_geometry import pose_from_message
from localization.logs.ros_stamps import stamp_to_dict
from localization.types import SECOND, InvalidReadingError
from teleop.robot.preview import PreviewAnswer, PreviewRequest
from teleop.rosbridge.graph.deferred_response import DeferredResponse
from teleop.rosbridge.protocol.protocol import Protocol
from teleop.rosbridge.timers import Timer

PERIOD: Final = SECOND // 10
"""Each client's requests are passed on this far apart [ns]."""

PATIENCE: Final = 3 * SECOND // 2
"""Time after which a request is answered without the estimator [ns]."""

OVERTAKEN: Final = "overtaken by a newer one"

NO_ANSWER: Final = (
    f"the localiser has not answered within {PATIENCE / SECOND:g} s: it is busy, or starts again"
)


@dataclass(slots=True, eq=False)
class _Call:
    """A request and its response."""

    request: PreviewRequest
    response: DeferredResponse
    timer: Timer | None = None


@dataclass(slots=True)
class _Queue:
    """The requests of one client."""

    asked: _Call | None = None
    """The one that is with the estimator."""
    waiting: _Call | None = None
    """The newest one, until it may be passed on."""
    next_time: int = 0
    """Earliest time at which it may be [ns]."""
    timer: Timer | None = None
    """Timer of that time."""


@dataclass(slots=True, eq=False)
class PreviewService:
    """Offers the service; owns the requests that have no answer yet."""

    protocol: Protocol
    ask: Callable[[PreviewRequest], object] = lambda request: None
    """Passes a request on to the estimator."""
    answer_at_once: Callable[[PreviewRequest], PreviewAnswer] | None = None
    """Answers a request, where estimating is done in the same process."""
    _queues: dict[int, _Queue] = field(default_factory=dict)
    # Answers to a server that is no more must not fit requests to this one.
    _numbers: Iterator[int] = field(default_factory=lambda: itertools.count(secrets.randbits(62)))

    def __post_init__(self) -> None:
        self.protocol.services.serve(
            "/localization/preview_hint", "farsteer_msgs/srv/PreviewHint", self._preview
        )

    def answered(self, answer: PreviewAnswer) -> None:
        """Give the answer of the estimator to the client that waits for it, if it still does."""
        for queue in list(self._queues.values()):
            if queue.asked is not None and queue.asked.request.number == answer.number:
                queue.asked.response.complete(_response(answer))
                return

    def forget(self, client: int) -> None:
        """Note that a client has left."""
        queue = self._queues.pop(client, None)
        if queue is not None and queue.timer is not None:
            queue.timer.cancel()

    def _preview(
        self, client: int, message: dict[str, Any], now: int
    ) -> dict[str, Any] | DeferredResponse:
        try:
            pose = pose_from_message(message["pose"])
        except InvalidReadingError as error:
            return _failure(str(error))
        request = PreviewRequest(next(self._numbers), client, pose)
        if self.answer_at_once is not None:
            return _response(self.answer_at_once(request))
        queue = self._queues.setdefault(client, _Queue())
        if queue.waiting is not None:
            queue.waiting.response.complete(_failure(OVERTAKEN))
        call = queue.waiting = _Call(request, DeferredResponse())
        call.response.on_done(lambda _: self._done(client, queue, call))
        call.timer = self.protocol.timers.at(
            now + PATIENCE, lambda _: call.response.complete(_failure(NO_ANSWER))
        )
        self._pass_on(client, now)
        return call.response

    def _pass_on(self, client: int, now: int) -> None:
        """Pass a client's newest request on, if the one before has its answer and it is not too soon."""
        queue = self._queues.get(client)
        if queue is None or queue.waiting is None or queue.asked is not None:
            return
        if now < queue.next_time:
            if queue.timer is None:
                queue.timer = self.protocol.timers.at(
                    queue.next_time, partial(self._due, client, queue)
                )
            return
        queue.asked, queue.waiting = queue.waiting, None
        queue.next_time = now + PERIOD
        self.ask(queue.asked.request)

    def _due(self, client: int, queue: _Queue, now: int) -> None:
        queue.timer = None
        self._pass_on(client, now)

    def _done(self, client: int, queue: _Queue, call: _Call) -> None:
        """Note that a request has its answer, by whatever way."""
        if call.timer is not None:
            call.timer.cancel()
        if queue.waiting is call:
            queue.waiting = None
        if queue.asked is call:
            queue.asked = None
            self._pass_on(client, self.protocol.timers.now)


def _response(answer: PreviewAnswer) -> dict[str, Any]:
    found = answer.preview
    if found is None:
        return _failure(answer.problem)
    text = f"the map explains {found.explained:.0%} of the last sweep there"
    if found.present is not None:
        text += f", {found.present:.0%} at the present pose"
    return {
        "success": True,
        "message": text,
        "explained": found.explained,
        "present": -1.0 if found.present is None else found.present,
        "stamp": stamp_to_dict(found.stamp),
    }


def _failure(reason: str) -> dict[str, Any]:
    return {"success": False, "message": reason, "explained": -1.0, "present": -1.0}
