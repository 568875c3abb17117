"""The work thread: in turn for each client, short work within long, and none for those who left."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable

import pytest

from teleop.rosbridge.messages import polite_threads
from teleop.rosbridge.messages.polite_threads import after_message
from teleop.rosbridge.server.work_thread import SHORT, WorkThread
from tests.teleop.rosbridge.server.test_server import in_a_loop, until


@pytest.fixture(autouse=True)
def no_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pause with each message, for no time."""
    monkeypatch.setattr(polite_threads, "_MESSAGES", 1)
    monkeypatch.setattr(polite_threads, "_PAUSE", 0.0)


class Held:
    """Keeps a thread busy until it is released."""

    def __init__(self, thread: WorkThread, client: int = 99) -> None:
        self._gate, self.begun = threading.Event(), threading.Event()
        self.task = asyncio.create_task(thread.run(client, 2 * SHORT, self._work))

    def _work(self) -> None:
        self.begun.set()
        assert self._gate.wait(20)

    def release(self) -> None:
        self._gate.set()


def work(done: list[str], name: str, pauses: int = 0) -> Callable[[], None]:
    def run() -> None:
        for _ in range(pauses):
            after_message()
        done.append(name)

    return run


@in_a_loop
async def test_newcomer_does_not_wait_for_what_others_have_queued() -> None:
    thread, done = WorkThread("test"), list[str]()

    async def flood(client: int) -> None:
        for _ in range(5):
            await thread.run(client, 2 * SHORT, work(done, f"flood {client}", 10))

    held = Held(thread)
    await until(held.begun.is_set)
    floods = [asyncio.create_task(flood(client)) for client in range(27)]
    await asyncio.sleep(0)
    held.release()
    await until(lambda: len(done) >= 60)  # each has used the thread
    before = len(done)
    await thread.run(50, 2 * SHORT, work(done, "newcomer", 10))
    assert done.index("newcomer") <= before + 3
    await asyncio.gather(*floods)
    assert len(done) == 27 * 5 + 1
    thread.close()


@in_a_loop
async def test_client_that_has_used_the_thread_less_comes_first() -> None:
    thread, done = WorkThread("test"), list[str]()
    await thread.run(1, 2 * SHORT, work(done, "before", 10))
    held = Held(thread)
    await until(held.begun.is_set)
    tasks = [
        asyncio.create_task(thread.run(client, 2 * SHORT, work(done, name)))
        for client, name in ((1, "much"), (2, "nothing"))
    ]
    await asyncio.sleep(0)
    held.release()
    await asyncio.gather(*tasks)
    thread.close()
    assert done == ["before", "nothing", "much"]


@in_a_loop
@pytest.mark.parametrize("used", [0, 3000])
async def test_short_work_is_done_in_the_pauses_of_long_work_unless_its_client_has_used_more(
    used: int,
) -> None:
    thread, done = WorkThread("test"), list[str]()
    begun, go = threading.Event(), threading.Event()
    await thread.run(2, 2 * SHORT, work(done, "before", used))

    def long() -> None:
        begun.set()
        assert go.wait(20)
        work(done, "long", 100)()

    longs = asyncio.create_task(thread.run(1, 2 * SHORT, long))
    await until(begun.is_set)
    short = asyncio.create_task(thread.run(2, SHORT, work(done, "short", 5)))
    await asyncio.sleep(0)
    go.set()
    await asyncio.gather(longs, short)
    thread.close()
    assert done[1:] == (["long", "short"] if used else ["short", "long"])


@in_a_loop
async def test_work_that_nobody_waits_for_is_neither_begun_nor_ended() -> None:
    thread, done = WorkThread("test"), list[str]()
    begun, go = threading.Event(), threading.Event()

    def endless() -> None:
        begun.set()
        assert go.wait(20)
        for _ in range(10_000):
            after_message()
        done.append("endless")

    running = asyncio.create_task(thread.run(1, 2 * SHORT, endless))
    await until(begun.is_set)
    waiting = asyncio.create_task(thread.run(2, SHORT, work(done, "waiting")))
    await asyncio.sleep(0)
    for task in (running, waiting):
        task.cancel()
    await asyncio.gather(running, waiting, return_exceptions=True)
    go.set()
    await thread.run(3, SHORT, work(done, "next"))
    thread.close()
    assert done == ["next"]


@in_a_loop
async def test_errors_of_work_are_raised_where_it_is_awaited() -> None:
    thread = WorkThread("test")

    def fail() -> None:
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        await thread.run(1, 0, fail)
    assert await thread.run(1, 0, lambda: 5) == 5
    thread.close()
