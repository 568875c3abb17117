"""Self-signed certificate for this machine's addresses, kept and renewed in time."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING, Final

from localization.extras import require
from teleop import clock
from teleop.console.lan.state_files import read_private, write_private

if TYPE_CHECKING:
    from cryptography import x509
    from cryptography.hazmat.primitives.asymmetric import ec

VALID: Final = timedelta(days=397)
"""Time for which a certificate is valid: browsers refuse some that are valid for more than 398 days."""
RENEWED_BEFORE: Final = timedelta(days=30)
"""Time before its end in which a certificate is renewed."""
_EARLY: Final = timedelta(days=1)
"""Time before its making from which a certificate is valid, for clients whose clocks are late."""
MOST_NAMES: Final = 32
"""Names and addresses of a certificate; with more, those of earlier networks are left out."""
_ALWAYS: Final = ("localhost", "127.0.0.1", "::1")


def ensure_certificate(certificate: Path, key: Path, names: Sequence[str]) -> str:
    """Make a certificate and its key unless valid ones are there; return its SHA-256 fingerprint.

    Args:
        certificate: PEM file of the certificate.
        key: PEM file of its key.
        names: Addresses and host names that it must be valid for, besides loopback.

    Raises:
        MissingLibraryError: If the library is missing.
        SettingError: If a file cannot be read or written, or is accessible to others.
    """
    require("cryptography", "--lan")
    from cryptography.hazmat.primitives.serialization import Encoding

    wanted = frozenset((*_ALWAYS, *names))
    kept = _kept(certificate, key)
    if kept is None or not _lasts(kept) or not wanted <= _names(kept):
        # A machine that goes to and fro between networks shall not need another one each time.
        earlier = frozenset() if kept is None else _names(kept)
        together = wanted | earlier
        kept = _make(certificate, key, sorted(together if len(together) <= MOST_NAMES else wanted))
    digest = hashlib.sha256(kept.public_bytes(Encoding.DER)).hexdigest().upper()
    return ":".join(digest[i : i + 2] for i in range(0, len(digest), 2))


def _kept(certificate: Path, key: Path) -> x509.Certificate | None:
    """Return the certificate in a file; None if it, or its key, is missing or damaged."""
    from cryptography import x509
    from cryptography.hazmat.primitives.serialization import load_pem_private_key

    pem, secret = read_private(certificate), read_private(key)
    if pem is None or secret is None:
        return None
    try:
        found = x509.load_pem_x509_certificate(pem)
        matches = load_pem_private_key(secret, None).public_key() == found.public_key()
    except (ValueError, TypeError):
        return None
    return found if matches else None


def _lasts(certificate: x509.Certificate) -> bool:
    """Return whether a certificate is valid, and for some time to come."""
    end = certificate.not_valid_after_utc - RENEWED_BEFORE
    return certificate.not_valid_before_utc <= _now() < end


def _names(certificate: x509.Certificate) -> frozenset[str]:
    """Return the host names and addresses that a certificate is for."""
    from cryptography import x509

    try:
        extension = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName)
    except x509.ExtensionNotFound:
        return frozenset()
    hosts = extension.value.get_values_for_type(x509.DNSName)
    addresses = extension.value.get_values_for_type(x509.IPAddress)
    return frozenset((*hosts, *map(str, addresses)))


def _make(certificate: Path, key: Path, names: Sequence[str]) -> x509.Certificate:
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

    secret = ec.generate_private_key(ec.SECP256R1())
    made = _signed(secret, names)
    # The key first: a certificate without its key would be taken for damaged, and made again.
    pem = secret.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    write_private(key, pem)
    write_private(certificate, made.public_bytes(Encoding.PEM))
    return made


def _signed(secret: ec.EllipticCurvePrivateKey, names: Sequence[str]) -> x509.Certificate:
    from cryptography import x509
    from cryptography.hazmat.primitives.hashes import SHA256
    from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "Farsteer robot")])
    now = _now()
    alternatives = x509.SubjectAlternativeName([_general_name(name) for name in names])
    usage = x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH])
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(secret.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _EARLY)
        .not_valid_after(now - _EARLY + VALID)
        .add_extension(alternatives, critical=False)
        .add_extension(usage, critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .sign(secret, SHA256())
    )


def _general_name(name: str) -> x509.GeneralName:
    from cryptography import x509

    try:
        return x509.IPAddress(ip_address(name))
    except ValueError:
        return x509.DNSName(name)


def _now() -> datetime:
    return datetime.fromtimestamp(clock.unix_seconds(), UTC)
