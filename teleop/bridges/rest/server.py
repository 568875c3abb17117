"""The HTTP server of the REST proxy."""

from __future__ import annotations

import asyncio
import contextlib
import ssl
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from typing import Final

from tornado.netutil import bind_sockets
from tornado.web import Application

from teleop.bridges.broker_check import why_unusable
from teleop.bridges.broker_options import BrokerOptions, is_loopback
from teleop.bridges.rest.bounded_server import BoundedServer
from teleop.bridges.rest.consumers import Consumers
from teleop.bridges.rest.handlers import MAX_BODY
from teleop.bridges.rest.pages import ROUTES
from teleop.bridges.rest.rest_config import RestConfig
from teleop.bridges.rest.state import State
from teleop.bridges.rest.topic_producer import TopicProducer
from teleop.errors import SettingError
from teleop.rosbridge import tls_context
from teleop.secret_files import read_secret

_TIMEOUT: Final = 10.0
"""Time for the body of a request [s]."""
_IDLE: Final = 60.0
"""Time for which a connection without requests is kept [s]."""
_SWEEP: Final = 10.0
"""Time between two looks for consumers that nobody asks [s]."""


@dataclass(frozen=True, slots=True)
class RestServer:
    """A running server."""

    url: str
    """Its address."""
    state: State
    """What its requests share."""


@contextlib.asynccontextmanager
async def rest_server(broker: BrokerOptions, config: RestConfig) -> AsyncIterator[RestServer]:
    """Serve while the block runs.

    Raises:
        SettingError: If a file or the port cannot be used.
    """
    settings, token = broker.settings(), read_secret(config.token_file, "token")
    context: ssl.SSLContext | None = None
    if config.tls_cert is not None and config.tls_key is not None:
        context = tls_context(config.tls_cert, config.tls_key)
    loop = asyncio.get_running_loop()
    state = State(
        TopicProducer(settings),
        Consumers(settings, loop.time),
        token,
        is_loopback(config.host),
        config.sendable,
    )
    routes = [(path, handler, {"state": state}) for path, handler in ROUTES]
    application = Application(routes, log_function=lambda handler: None)
    server = BoundedServer(
        application,
        ssl_options=context,
        max_body_size=MAX_BODY,
        max_buffer_size=MAX_BODY + 65_536,
        body_timeout=_TIMEOUT,
        idle_connection_timeout=_IDLE,
    )
    try:
        sockets = bind_sockets(config.port, config.host)
    except OSError as error:
        raise SettingError(
            f"cannot listen on {config.host}:{config.port}: {error.strerror}"
        ) from None
    server.add_sockets(sockets)
    sweep = asyncio.create_task(_end_idle(state.consumers))
    port = sockets[0].getsockname()[1]
    host = f"[{config.host}]" if ":" in config.host else config.host
    try:
        yield RestServer(f"{'https' if context else 'http'}://{host}:{port}", state)
    finally:
        sweep.cancel()
        server.stop()
        await server.close_all_connections()
        await state.consumers.close()
        await state.producer.close()


async def serve_rest(
    broker: BrokerOptions, config: RestConfig, say: Callable[[str], object]
) -> None:
    """Serve until it is cancelled.

    Raises:
        SettingError: If a file or the port cannot be used.
    """
    for warning in _warnings(broker, config):
        say(f"warning: {warning}")
    async with rest_server(broker, config) as server:
        say(f"{server.url} is in front of {broker.brokers}; Ctrl-C ends.")
        if (why := await why_unusable(broker)) is not None:
            say(f"no broker yet: {why}")
        await asyncio.Event().wait()


def _warnings(broker: BrokerOptions, config: RestConfig) -> list[str]:
    """Return what is missing for clients and brokers beyond this machine."""
    warnings = [warning] if (warning := broker.warning()) is not None else []
    if not is_loopback(config.host):
        if config.token_file is None:
            warnings.append(
                f"--host {config.host} without --token-file: everybody may send commands"
            )
        elif config.tls_cert is None:
            warnings.append(
                "--token-file without --tls-cert: everybody on the way can read the token"
            )
    return warnings


async def _end_idle(consumers: Consumers) -> None:
    while True:
        await asyncio.sleep(_SWEEP)
        await consumers.end_idle()
