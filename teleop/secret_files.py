"""Files that hold a token, a password or a certificate."""

from __future__ import annotations

import ssl
from pathlib import Path

from teleop.errors import SettingError


def read_secret(path: Path | None, what: str) -> str | None:
    """Return the line of a file; None without a file.

    Raises:
        SettingError: If it cannot be read, or holds anything but one line of ASCII.
    """
    if path is None:
        return None
    try:
        secret = path.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is no text"
        raise SettingError(f"cannot read the {what} of {path}: {reason}") from None
    if not secret.isascii() or not secret.isprintable() or not secret:
        raise SettingError(f"{path} must hold a {what}, in one line of ASCII")
    return secret


def trust(ca: Path | None) -> ssl.SSLContext | None:
    """Return a context that trusts a certificate and no other; None without one.

    Raises:
        SettingError: If the file holds no certificate.
    """
    if ca is None:
        return None
    try:
        return ssl.create_default_context(cafile=str(ca))
    except ssl.SSLError:
        raise SettingError(f"{ca} holds no certificate (PEM)") from None
    except OSError as error:
        raise SettingError(f"cannot read the certificate {ca}: {error.strerror}") from None
