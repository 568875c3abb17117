"""Records in bodies: from JSON to bytes for Kafka, and back."""

from __future__ import annotations

import base64
import binascii
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from aiokafka import ConsumerRecord

from teleop.bridges.rest.errors import Failure
from teleop.bridges.rest.media_types import Format

MAX_RECORDS: Final = 1000
"""Records of one request; chosen."""

AHEAD: Final = 3600.0
"""How far in the future a record's time may be [s]; ``message.timestamp.after.max.ms`` of Apache Kafka 4."""

_KNOWN: Final = {"key", "value", "partition", "timestamp"}


@dataclass(frozen=True, slots=True)
class NewRecord:
    """A record to be sent."""

    key: bytes | None
    value: bytes | None
    partition: int | None
    timestamp: int | None
    """[ms since 1970]"""


def read_records(body: Mapping[str, Any], format: Format, now: float) -> list[NewRecord]:
    """Return the records of a body, received at a time [s since 1970]; 422 if they are invalid."""
    records = body.get("records")
    if not isinstance(records, list) or not 0 < len(records) <= MAX_RECORDS:
        raise Failure.UNREADABLE.error(f"records must be a list of 1 to {MAX_RECORDS} records")
    return [_read(record, format, number, now) for number, record in enumerate(records)]


def _read(record: object, format: Format, number: int, now: float) -> NewRecord:
    where = f"records[{number}]"
    if not isinstance(record, dict) or "value" not in record or record.keys() - _KNOWN:
        raise Failure.UNREADABLE.error(
            f"{where} must be an object of value, and key, partition, timestamp if wanted"
        )
    return NewRecord(
        _bytes(record.get("key"), format, f"{where}.key"),
        _bytes(record["value"], format, f"{where}.value"),
        _integer(record.get("partition"), f"{where}.partition"),
        _timestamp(record.get("timestamp"), f"{where}.timestamp", now),
    )


def _bytes(value: object, format: Format, where: str) -> bytes | None:
    if value is None:
        return None
    if format == "json":
        # As ASCII: JSON may hold halves of characters, UTF-8 may not.
        try:
            return json.dumps(value, separators=(",", ":"), allow_nan=False).encode()
        except ValueError:
            raise Failure.UNREADABLE.error(
                f"{where} has a number that JSON does not know"
            ) from None
    if not isinstance(value, str):
        raise Failure.UNREADABLE.error(f"{where} must be base64 in a text")
    try:
        return base64.b64decode(value, validate=True)
    except (binascii.Error, ValueError):
        raise Failure.UNREADABLE.error(f"{where} is no base64") from None


def _integer(value: object, where: str) -> int | None:
    if value is None or (isinstance(value, int) and not isinstance(value, bool) and value >= 0):
        return value
    raise Failure.UNREADABLE.error(f"{where} must be a whole number from 0")


def _timestamp(value: object, where: str, now: float) -> int | None:
    timestamp = _integer(value, where)
    if timestamp is not None and timestamp > (now + AHEAD) * 1e3:
        raise Failure.UNREADABLE.error(
            f"{where} must be milliseconds since 1970, at most an hour ahead of this machine's clock"
        )
    return timestamp


def record_json(record: ConsumerRecord, format: Format) -> dict[str, Any]:
    """Return a record as it is sent to a client.

    What is no JSON is sent as text to a client that reads JSON: one foreign record keeps nobody from the others.
    """
    return {
        "topic": record.topic,
        "key": _value(record.key, format),
        "value": _value(record.value, format),
        "partition": record.partition,
        "offset": record.offset,
    }


def _value(data: bytes | None, format: Format) -> Any:
    if data is None:
        return None
    if format == "binary":
        return base64.b64encode(data).decode()
    try:
        return json.loads(data, parse_constant=lambda name: name)
    except (ValueError, RecursionError):
        return data.decode(errors="replace")
