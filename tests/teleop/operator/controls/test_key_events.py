"""Bytes of terminals as key events."""

from __future__ import annotations

import pytest

from teleop.operator.controls.key_events import Input, Key, KeyDecoder, KeyEvent, TerminalReport

_REPEAT, _RELEASE = KeyEvent.REPEAT, KeyEvent.RELEASE


@pytest.mark.parametrize(
    ("data", "found"),
    [
        (b"w", [Key("w")]),
        (b"W", [Key("w")]),  # Caps Lock changes nothing
        (b"\x1b[A\x1b[Dq", [Key("up"), Key("left"), Key("q")]),
        (b"\x1bOA", [Key("up")]),  # application mode
        (b"\x1b[119;1:2u", [Key("w", _REPEAT)]),
        (b"\x1b[119;1:3u", [Key("w", _RELEASE)]),
        (b"\x1b[119;2:3u", [Key("w", _RELEASE)]),  # with shift
        (b"\x1b[119:87;66:1u", [Key("w")]),  # alternate key and Caps Lock
        (b"\x1b[1;1:3B", [Key("down", _RELEASE)]),
        (b"\x1b[99;5u", [Key("ctrl-c")]),
        (b"\x03", [Key("ctrl-c")]),
        (b"\x1b[27u\r\x7f", [Key("escape"), Key("enter"), Key("backspace")]),
        (b"\x1b[?3u", [TerminalReport.KITTY]),
        (b"\x1b[?62;4c", [TerminalReport.ATTRIBUTES]),
        (b"\x1b[0n", [TerminalReport.ALIVE]),
        (b"\x1b[O\x1b[I", [TerminalReport.FOCUS_LOST, TerminalReport.FOCUS_GAINED]),
        (b"\x1b[>1;2c\x1b[200~\x1b[1;5F\x1b[0u", []),  # of no use here
        ("ü".encode(), [Key("ü")]),
        (b"\x1b\x1b[A", [Key("escape"), Key("up")]),
    ],
)
def test_what_terminals_send_is_decoded(data: bytes, found: list[Input]) -> None:
    assert KeyDecoder().feed(data) == found


def test_sequences_may_come_byte_by_byte() -> None:
    decoder = KeyDecoder()
    found = [event for byte in b"w\x1b[119;1:3u\x1b[A" for event in decoder.feed(bytes([byte]))]
    assert found == [Key("w"), Key("w", _RELEASE), Key("up")]
    assert decoder.idle() == []


def test_escape_alone_is_the_key_once_nothing_follows() -> None:
    decoder = KeyDecoder()
    assert decoder.feed(b"\x1b") == []
    assert decoder.idle() == [Key("escape")]
    assert decoder.idle() == []


def test_endless_sequence_is_given_up() -> None:
    decoder = KeyDecoder()
    found = decoder.feed(b"\x1b[" + b"1" * 1000)
    assert found[0] == Key("escape")
    assert decoder.feed(b"w")[-1] == Key("w")
