"""A producer that is made again when its broker is lost."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator
from typing import Any, Final

from aiokafka import AIOKafkaProducer
from aiokafka.errors import UnknownError, UnsupportedVersionError

from teleop.bridges.client_life import TIMEOUT, cancelled_requests, start, stop

_LOG: Final = logging.getLogger(__name__)


class Producer:
    """A producer of aiokafka, of which there is one while it works."""

    def __init__(self, settings: dict[str, Any], *, idempotent: bool) -> None:
        """Create it without a connection.

        Args:
            settings: Arguments of aiokafka's clients.
            idempotent: Whether the broker is to recognise repetitions of what was cut off; where it cannot, the same
                is sent without.
        """
        self._settings = settings
        self._idempotent = idempotent
        self._producer: AIOKafkaProducer | None = None
        self._starting = asyncio.Lock()

    async def send(self, topic: str, value: bytes, *, key: bytes, partition: int | None) -> int:
        """Send a record, wait until the broker has it, and return its offset.

        Raises:
            KafkaError: If the broker does not take it; TimeoutError and OSError likewise. It may have it all the same.
        """
        async with self.answering() as producer:
            sent = await producer.send_and_wait(topic, value, key=key, partition=partition)
        return int(sent.offset)

    @contextlib.asynccontextmanager
    async def answering(self) -> AsyncIterator[AIOKafkaProducer]:
        """Give the producer, connected, for a request; where it fails, the next one begins with the brokers' addresses.

        Raises:
            KafkaError: If there is no broker, or none that answers; TimeoutError and OSError likewise.
        """
        try:
            with cancelled_requests():
                async with asyncio.timeout(2 * TIMEOUT):
                    yield await self._started()
        except BaseException:
            await self.close()
            raise

    async def close(self) -> None:
        """Give up the connection; the next record opens another."""
        producer, self._producer = self._producer, None
        if producer is not None:
            await stop(producer)

    async def _started(self) -> AIOKafkaProducer:
        async with self._starting:
            if self._producer is None:
                try:
                    self._producer = await self._start(self._idempotent)
                except (UnknownError, UnsupportedVersionError):
                    if not self._idempotent:
                        raise
                    _LOG.info("the broker knows no idempotent producers")
                    self._idempotent = False
                    self._producer = await self._start(False)
            return self._producer

    async def _start(self, idempotent: bool) -> AIOKafkaProducer:
        producer = AIOKafkaProducer(
            **self._settings,
            acks="all",
            enable_idempotence=idempotent,
            request_timeout_ms=int(TIMEOUT * 1e3),
        )
        await start(producer)
        return producer
