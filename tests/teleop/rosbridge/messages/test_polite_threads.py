"""Threads that leave the event loop its turns."""

from __future__ import annotations

import threading
from typing import Any

import pytest

from teleop.rosbridge.messages import polite_threads
from teleop.rosbridge.messages.json_cbor_codec import Codec
from teleop.rosbridge.messages.message_completion import complete
from teleop.rosbridge.messages.polite_threads import polite_thread
from tests.teleop.rosbridge.support import REGISTRY


def test_polite_thread_pauses_with_the_messages_that_it_completes_and_encodes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pauses: list[str] = []

    class Never:
        def wait(self, seconds: float) -> None:
            pauses.append(threading.current_thread().name)

    monkeypatch.setattr(polite_threads, "_NEVER", Never())
    partial: dict[str, Any] = {"poses": [{"position": {"x": 1.0}}] * 1000}
    kind = REGISTRY["geometry_msgs/PoseArray"]

    def work() -> None:
        message = complete(REGISTRY, kind, partial)
        Codec(REGISTRY).json(kind, message)
        Codec(REGISTRY).cbor(kind, message)

    def politely() -> None:
        with polite_thread():
            work()

    thread = threading.Thread(target=politely, name="worker")
    thread.start()
    work()
    thread.join()
    assert set(pauses) == {"worker"}
    assert 50 <= len(pauses) <= 80
    work()
    assert len(pauses) <= 80
