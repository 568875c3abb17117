"""Connecting to a robot that may not be there yet."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final

from teleop.rosbridge import Client
from teleop.rosbridge.errors import ClientError

_SEARCH: Final = 5.0
"""Time between two attempts, besides the second that each lasts [s]."""


async def connect(client: Client, say: Callable[[str], object]) -> None:
    """Connect as soon as the robot is there; from then on the client reconnects by itself.

    Raises:
        ClientError: If the address is no robot's, or does not accept the token.
    """
    while True:
        try:
            return await client.connect(patience=1.0)
        except ClientError as error:
            if not isinstance(error.__cause__, OSError):
                raise
            say(f"{error}; trying again")
            await asyncio.sleep(_SEARCH)
