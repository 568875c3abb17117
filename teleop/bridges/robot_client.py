"""The client by which a bridge talks to a robot, which may not be there yet."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Final

from teleop.ros_types import registry
from teleop.rosbridge import Client, ConnectionState
from teleop.rosbridge.errors import ClientError
from teleop.secret_files import read_secret, trust

_SEARCH: Final = 5.0
"""Time between two attempts, besides the second that each lasts [s]."""


@asynccontextmanager
async def robot_client(
    robot: str, token_file: Path | None, ca: Path | None, say: Callable[[str], object]
) -> AsyncIterator[Client]:
    """Yield a client that says when the robot is found and lost, and close it.

    Of the errors of a task group in the block the first is raised alone.

    Raises:
        SettingError: If the token or the certificate cannot be read.
    """
    token = read_secret(token_file, "token")
    client = Client(robot, registry=registry(), token=token, tls=trust(ca))

    def note(state: ConnectionState) -> None:
        if state is ConnectionState.CONNECTED:
            say(f"{client.url} is connected")
        elif state is ConnectionState.DISCONNECTED:
            say(f"lost {client.url}: {client.closed_reason}")

    client.on_connection(note)
    try:
        yield client
    except* Exception as errors:
        raise errors.exceptions[0] from None
    finally:
        await client.close()


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
