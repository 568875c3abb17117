"""Which Kafka broker is used, and how it is logged in to."""

from __future__ import annotations

import ipaddress
import ssl
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from teleop.errors import SettingError
from teleop.secret_files import read_secret, trust


@dataclass(frozen=True, slots=True)
class BrokerOptions:
    """Addresses, encryption and login of a Kafka broker; each field is an option of the command."""

    brokers: str
    """Addresses of brokers to begin with, HOST:PORT, separated by commas."""
    tls: bool = False
    """Whether connections to brokers are encrypted."""
    broker_ca: Path | None = None
    """Certificate to trust at the brokers, if this machine does not trust it already (PEM)."""
    client_cert: Path | None = None
    """Certificate by which this client logs in to the brokers (PEM)."""
    client_key: Path | None = None
    """Private key of that certificate (PEM)."""
    sasl: Literal["PLAIN", "SCRAM-SHA-256", "SCRAM-SHA-512"] | None = None
    """Mechanism by which this client logs in to the brokers with name and password."""
    sasl_user: str | None = None
    """Name for the login."""
    sasl_password_file: Path | None = None
    """File with the password for the login, in a line of its own."""

    def __post_init__(self) -> None:
        for address in self.brokers.split(","):
            host, _, port = address.strip().rpartition(":")
            if not host or not port.isdigit() or not 0 < int(port) < 65536:
                raise SettingError(
                    f"brokers must be HOST:PORT, separated by commas, got {address!r}"
                )
        login = (self.sasl_user, self.sasl_password_file)
        if self.sasl is None and login != (None, None):
            raise SettingError("a name or password needs the mechanism of the login: --sasl PLAIN")
        if self.sasl is not None and None in login:
            raise SettingError(
                f"--sasl {self.sasl} needs --sasl-user and --sasl-password-file as well"
            )
        if not self.tls and (self.broker_ca, self.client_cert, self.client_key) != (None,) * 3:
            raise SettingError("certificates are for encrypted connections: add --tls")
        if (self.client_cert is None) != (self.client_key is None):
            raise SettingError("--client-cert and --client-key belong together: give both")

    def settings(self) -> dict[str, Any]:
        """Return the arguments of aiokafka's clients.

        Raises:
            SettingError: If a file cannot be used.
        """
        settings: dict[str, Any] = {"bootstrap_servers": self.addresses}
        protocol = ("SASL_" if self.sasl else "") + ("SSL" if self.tls else "PLAINTEXT")
        settings["security_protocol"] = protocol
        if self.tls:
            settings["ssl_context"] = self._context()
        if self.sasl is not None:
            settings["sasl_mechanism"] = self.sasl
            settings["sasl_plain_username"] = self.sasl_user
            settings["sasl_plain_password"] = read_secret(self.sasl_password_file, "password")
        return settings

    @property
    def addresses(self) -> list[str]:
        """The addresses one by one."""
        return [address.strip() for address in self.brokers.split(",")]

    def warning(self) -> str | None:
        """Return what is missing for brokers beyond this machine, in one line; None if nothing is."""
        if all(is_loopback(address.rpartition(":")[0]) for address in self.addresses):
            return None
        if not self.tls:
            return f"{self.brokers} without --tls: everybody on the way can read and send commands"
        if self.sasl is None and self.client_cert is None:
            return f"{self.brokers} without --sasl or --client-cert: whoever reaches it may send commands"  # words: ok
        return None

    def _context(self) -> ssl.SSLContext:
        context = trust(self.broker_ca) or ssl.create_default_context()
        if self.client_cert is not None and self.client_key is not None:
            try:
                context.load_cert_chain(self.client_cert, self.client_key, _no_passphrase)
            except (OSError, ssl.SSLError) as error:
                raise SettingError(
                    f"cannot use {self.client_cert} and {self.client_key}: {error.strerror or error.args[-1]}"
                ) from None
        return context


def is_loopback(host: str) -> bool:
    """Return whether a host is this machine, by its name or address alone."""
    host = host.strip("[]").lower()
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _no_passphrase() -> str:
    raise SettingError("the key of --client-key has a passphrase; it must have none")
