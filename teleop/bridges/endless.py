"""A guard around the parts of the bridge, none of which may end by itself."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable

from teleop.errors import TeleopError


class PartEndedError(TeleopError):
    """A part of the bridge has ended without an error, though all of them run until they are cancelled."""


async def endless(name: str, part: Awaitable[None]) -> None:
    """Run a part that never ends.

    A task group takes neither a part that returns nor one that ends by a cancellation from within, such as that of a
    library's own request, for a failure: the other parts would go on without it, and no command would be driven or
    answered any more.

    Args:
        name: The part, for the message.
        part: What it does.

    Raises:
        PartEndedError: If it ends, in another way than by the cancellation of this task or an error of its own.
    """
    try:
        await part
    except asyncio.CancelledError:
        task = asyncio.current_task()
        if task is None or task.cancelling():
            raise
        raise PartEndedError(f"the {name} of the bridge was cancelled; start it again") from None
    raise PartEndedError(f"the {name} of the bridge has ended; start it again")
