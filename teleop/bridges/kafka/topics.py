"""The topics of a bridge: made if they are missing, and the partition that commands are read from."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterable
from typing import Any, Final

from aiokafka import AIOKafkaProducer
from aiokafka.admin import AIOKafkaAdminClient, NewTopic
from aiokafka.errors import KafkaError, TopicAlreadyExistsError
from aiokafka.partitioner import murmur2

from teleop.bridges.client_life import TIMEOUT, cancelled_requests, refused_logins, running
from teleop.errors import SettingError

_LOG: Final = logging.getLogger(__name__)


async def make_topics(settings: dict[str, Any], topics: Iterable[str]) -> None:
    """Make the topics that are missing, with one partition each, since order holds within a partition only.

    A broker that lets nobody make topics, or does not know how, is left alone: most make a topic when it is first used.

    Raises:
        KafkaError: If there is no broker; TimeoutError and OSError likewise.
    """
    with cancelled_requests(), refused_logins():
        async with asyncio.timeout(2 * TIMEOUT):
            admin = AIOKafkaAdminClient(**settings, request_timeout_ms=int(TIMEOUT * 1e3))
            try:
                await admin.start()  # aiokafka ends what a failing start leaves
                missing = sorted({*topics} - {*await admin.list_topics()})
                if missing:
                    await admin.create_topics([NewTopic(topic, 1, 1) for topic in missing])
            except TopicAlreadyExistsError:  # made by another one meanwhile
                pass
            except (AttributeError, KafkaError) as error:
                # aiokafka knows no answer for brokers without a controller.
                if not isinstance(error, AttributeError) and error.retriable:
                    raise
                _LOG.info("topics are not made: %s", error)
            finally:
                await admin.close()


async def partition_of(
    settings: dict[str, Any], topic: str, partition: int | None, key: str | None
) -> int:
    """Return the partition that the commands are read from.

    Args:
        settings: Arguments of aiokafka's clients.
        topic: Topic of the commands.
        partition: The partition, if it was named.
        key: Key of the commands, if they have one.

    Raises:
        SettingError: If the topic has several partitions and none was named, or not the one that was.
        KafkaError: If there is no broker; TimeoutError and OSError likewise.
    """
    producer = AIOKafkaProducer(**settings, request_timeout_ms=int(TIMEOUT * 1e3))
    async with running(producer), asyncio.timeout(2 * TIMEOUT):
        there = sorted(await producer.partitions_for(topic))
    if partition is not None:
        if partition not in there:
            raise SettingError(
                f"{topic} has partitions {', '.join(map(str, there))}, not {partition}"
            )
        return partition
    if len(there) == 1:
        return int(there[0])
    if key is not None:
        # Where Kafka's own clients put a record of this key.
        return int(there[(murmur2(key.encode()) & 0x7FFFFFFF) % len(there)])
    raise SettingError(
        f"{topic} has {len(there)} partitions, and order holds within one only:"
        " name it with --partition, or the commands' key with --key"
    )
