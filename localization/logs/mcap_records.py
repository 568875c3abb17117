"""Records of an MCAP file in file order, up to the place where it is damaged or cut short."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import zstandard
from mcap.exceptions import InvalidMagic, McapError
from mcap.records import Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import CRCValidationError, StreamReader, breakup_chunk

from localization.logs.log_interface import LogError

TF_STATIC: Final = "/tf_static"
"""Topic of the scanners' mounts."""
METADATA_NAME: Final = "farsteer"
"""Name of our metadata record."""
_MAGIC: Final = b"\x89MCAP0\r\n"


@dataclass(frozen=True, slots=True)
class CdrMessage:
    """A message as the file holds it."""

    topic: str
    """Topic of its channel."""
    type: str
    """Message type such as ``sensor_msgs/msg/Imu``; the encoding instead if that is not CDR."""
    log_time: int
    """Time at which it was logged [ns]."""
    data: bytes
    """CDR bytes of the message."""


def records(path: Path, *, complete: bool) -> Iterator[tuple[float, Metadata | CdrMessage]]:
    """Yield metadata and messages in file order, each with the fraction of the file read so far.

    Args:
        path: File to read.
        complete: Whether it was closed properly; if so, a cut record is an error, otherwise the end.

    Raises:
        LogError: At the place where the file is damaged.
    """
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    for share, record in _raw_records(path, complete):
        match record:
            case Schema():
                schemas[record.id] = record
            case Channel():
                channels[record.id] = record
            case Metadata():
                yield share, record
            case Message():
                channel = channels.get(record.channel_id)
                if channel is None:
                    raise LogError(f"{path}: damaged: a message without a channel")
                schema = schemas.get(channel.schema_id)
                kind = schema.name if schema and channel.message_encoding == "cdr" else ""
                kind = kind or f"encoding {channel.message_encoding!r}"
                yield share, CdrMessage(channel.topic, kind, record.log_time, record.data)


def is_ours(path: Path | str) -> bool:
    """Return whether a file is an MCAP log that ``ReadingsWriter`` wrote, complete or cut short.

    Raises:
        LogError: If it cannot be read.
    """
    path = Path(path)
    with path.open("rb") as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            return False
    for _, record in _raw_records(path, complete=False):
        if isinstance(record, Metadata):
            return bool(record.name == METADATA_NAME)
        if isinstance(record, Message):
            return False
    return False


def ends_properly(path: Path) -> bool:
    """Return whether an MCAP file was closed by its writer.

    Raises:
        LogError: If it cannot be read, or is not an MCAP file.
    """
    try:
        with path.open("rb") as file:
            if not (start := file.read(len(_MAGIC))):
                raise LogError(f"{path}: is empty")
            if start != _MAGIC:
                raise LogError(f"{path}: is not an MCAP file; logs begin with {_MAGIC!r}")
            file.seek(-len(_MAGIC), 2)
            return file.tell() > 0 and file.read() == _MAGIC
    except OSError as error:
        raise LogError(f"{path}: {error.strerror}") from error


def _raw_records(path: Path, complete: bool) -> Iterator[tuple[float, McapRecord]]:
    """Yield the records of a file in order with chunks unpacked, each with the fraction of the file read.

    A file that was never closed ends before its first cut record; in a closed one such a record is damage.
    """
    # The library's seeking reader sorts and needs the index at the end; the stream reader needs neither.
    size = max(1, path.stat().st_size)
    with path.open("rb") as file:
        records: Iterator[Any] = StreamReader(file, emit_chunks=True).records
        while True:
            try:
                record = next(records)
            except StopIteration:
                return
            except (McapError, struct.error, UnicodeDecodeError, MemoryError) as error:
                if complete or isinstance(error, InvalidMagic):
                    raise LogError(f"{path}: damaged: {error or 'ends early'}") from error
                return
            share = file.tell() / size
            if not isinstance(record, Chunk):
                yield share, record
                continue
            try:
                inside = breakup_chunk(record, validate_crc=True)
            except (CRCValidationError, McapError, zstandard.ZstdError, struct.error) as error:
                raise LogError(f"{path}: damaged: a chunk cannot be unpacked: {error}") from error
            yield from ((share, each) for each in inside)
