"""Whether a client has closed its side of a connection, of which asyncio says nothing while reading is paused."""

from __future__ import annotations

import asyncio
import select


class HangUp:
    """Asks the kernel, where that is possible: on Linux."""

    def __init__(self, transport: asyncio.Transport) -> None:
        self._poll: select.poll | None = None
        if hasattr(select, "POLLRDHUP"):
            self._poll = select.poll()
            self._poll.register(transport.get_extra_info("socket"), select.POLLRDHUP)

    def seen(self) -> bool:
        """Return whether the client will send no more; only while the transport is open."""
        return self._poll is not None and bool(self._poll.poll(0))
