"""TLS context of a certificate and its private key."""

from __future__ import annotations

import ssl
import stat
from pathlib import Path

from teleop.rosbridge.errors import ServerError


def tls_context(certificate: Path, key: Path) -> ssl.SSLContext:
    """Return the ``tls`` argument of ``Server``, for TLS 1.2 or newer.

    Args:
        certificate: PEM file of the certificate, followed by those of its issuers.
        key: PEM file of its private key, which must not be accessible to others.

    Raises:
        ServerError: If they are invalid; the message is one line.
    """
    for what, path in (("certificate", certificate), ("key", key)):
        try:
            with path.open("rb"):
                pass
        except OSError as error:
            raise ServerError(f"cannot read the TLS {what} {path}: {error.strerror}") from error
    if key.stat().st_mode & stat.S_IRWXO:
        raise ServerError(f"the TLS key {key} is accessible to others: chmod 600 {key.name}")
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2

    def no_passphrase() -> str:
        raise ServerError(f"the TLS key {key} has a passphrase; it must have none")

    try:
        context.load_cert_chain(certificate, key, no_passphrase)
    except ssl.SSLError as error:
        if error.reason == "KEY_VALUES_MISMATCH":
            what = "do not match"
        else:
            what = "are not PEM files of a certificate and its key"
        raise ServerError(f"{certificate} and {key} {what}") from None
    return context
