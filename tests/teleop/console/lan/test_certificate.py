"""The certificate of this machine's addresses."""

from __future__ import annotations

import stat
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.hashes import SHA256

from teleop import clock
from teleop.console.lan.certificate import MOST_NAMES, RENEWED_BEFORE, VALID, ensure_certificate
from teleop.rosbridge import tls_context

NAMES = ("192.168.1.7", "robot.local")


def made(folder: Path, *names: str) -> str:
    return ensure_certificate(folder / "robot.crt", folder / "robot.key", names or NAMES)


def test_certificate_names_all_addresses_and_the_server_takes_it(tmp_path: Path) -> None:
    fingerprint = made(tmp_path)
    found = x509.load_pem_x509_certificate((tmp_path / "robot.crt").read_bytes())
    names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert set(names.get_values_for_type(x509.DNSName)) == {"localhost", "robot.local"}
    wanted = {ip_address(a) for a in ("127.0.0.1", "::1", "192.168.1.7")}
    assert set(names.get_values_for_type(x509.IPAddress)) == wanted
    assert fingerprint == found.fingerprint(SHA256()).hex(":").upper()
    assert found.not_valid_after_utc - found.not_valid_before_utc <= timedelta(days=398)
    assert stat.S_IMODE((tmp_path / "robot.key").stat().st_mode) == 0o600
    tls_context(tmp_path / "robot.crt", tmp_path / "robot.key")


def test_certificate_is_kept_while_it_serves(tmp_path: Path) -> None:
    first = made(tmp_path)
    assert made(tmp_path) == first
    assert made(tmp_path, "192.168.1.7") == first
    other = made(tmp_path, "10.0.0.2")
    assert other != first
    assert made(tmp_path) == other  # back in the first network


def test_addresses_of_earlier_networks_are_forgotten_when_they_are_many(tmp_path: Path) -> None:
    for last in range(1, 60):
        made(tmp_path, f"10.0.0.{last}")
        found = x509.load_pem_x509_certificate((tmp_path / "robot.crt").read_bytes())
        names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        assert len(list(names)) <= MOST_NAMES
        assert ip_address(f"10.0.0.{last}") in names.get_values_for_type(x509.IPAddress)


def test_certificate_is_renewed_in_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = made(tmp_path)
    end = datetime.now(UTC) + VALID - RENEWED_BEFORE
    for moment, same in ((end - timedelta(days=2), True), (end, False)):
        monkeypatch.setattr(clock, "unix_seconds", moment.timestamp)
        assert (made(tmp_path) == first) == same
    # A clock that was wrong when it was made is no reason to keep it.
    early = datetime.now(UTC) - timedelta(days=100)
    monkeypatch.setattr(clock, "unix_seconds", early.timestamp)
    assert made(tmp_path) != first


@pytest.mark.parametrize("damage", ["robot.crt", "robot.key"])
@pytest.mark.parametrize("content", [None, b"", b"no PEM"])
def test_damaged_files_are_made_anew(damage: str, content: bytes | None, tmp_path: Path) -> None:
    first = made(tmp_path)
    if content is None:
        (tmp_path / damage).unlink()
    else:
        (tmp_path / damage).write_bytes(content)
    assert made(tmp_path) != first
    tls_context(tmp_path / "robot.crt", tmp_path / "robot.key")


def test_key_of_another_certificate_is_noticed(tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        made(tmp_path / name)
    (tmp_path / "one/robot.key").replace(tmp_path / "two/robot.key")
    made(tmp_path / "two")
    tls_context(tmp_path / "two/robot.crt", tmp_path / "two/robot.key")
