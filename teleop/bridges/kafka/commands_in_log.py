"""What is read from a log of commands: commands, and losses."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TypeAlias

from aiokafka import ConsumerRecord

from teleop.bridges.kafka.journal_state import Mark


@dataclass(frozen=True, slots=True)
class Command:
    """A record of the log."""

    offset: int
    """Its offset in the partition."""
    timestamp: int
    """Its time, by the clock of the producer or the broker, as the topic says [ms since 1970]."""
    key: bytes | None
    """Its key; None without one."""
    value: bytes | None
    """Its value; None of a record that deletes others."""
    arrived: float
    """When the bridge received it, by this machine's clock [s since 1970]."""
    end: int
    """End of the log as it was last seen."""
    mark: Mark
    """What it is recognised by."""


@dataclass(frozen=True, slots=True)
class Loss:
    """Commands that are gone without having been read; reading goes on at ``next``."""

    lost: int
    """How many commands are known to be gone, or cannot be distinguished from those that were driven."""
    reason: str
    """For people."""
    again: bool
    """Whether the log has begun again, so that offsets have another meaning from here on."""
    next: int
    """Offset at which reading goes on."""
    end: int
    """End of the log now."""
    mark: Mark | None
    """The command before ``next``; None if unknown."""


LogEvent: TypeAlias = Command | Loss


def mark_of(record: ConsumerRecord) -> Mark:
    """Return what a record is recognised by."""
    digest = hashlib.sha256()
    for part in (str(record.timestamp).encode(), record.key or b"", record.value or b""):
        digest.update(len(part).to_bytes(8, "big") + part)
    return Mark(record.timestamp, digest.hexdigest()[:16])


def command_of(record: ConsumerRecord, arrived: float, end: int) -> Command:
    """Return a record as a command."""
    return Command(
        *(record.offset, record.timestamp, record.key, record.value),
        *(arrived, max(end, record.offset + 1), mark_of(record)),
    )
