"""Why a broker cannot be used, and what would help: aiokafka keeps the reason to itself."""

from __future__ import annotations

import asyncio
import os
import ssl
from typing import Final

from teleop.bridges.broker_options import BrokerOptions
from teleop.rosbridge.client.connector import OTHER_NAME

_TIMEOUT: Final = 3.0
"""Time for a handshake [s]."""

_PROBE: Final = 1.0
"""Time for the handshake of a broker that may not know of TLS [s]."""

_ALERT: Final = 0.3
"""Time in which a broker says, after the handshake, that it wants a certificate [s]."""


async def why_unusable(broker: BrokerOptions) -> str | None:
    """Return what keeps this machine from the first broker, in one line with what would help; None if nothing is found.

    It connects and sends no request, so that a login that is refused is not found.
    """
    address = broker.addresses[0]
    host, _, port = address.rpartition(":")
    host = host.strip("[]")
    context: ssl.SSLContext | None = broker.settings().get("ssl_context")
    try:
        async with asyncio.timeout(_TIMEOUT):
            if context is not None:
                closed = await _closed_after_handshake(host, int(port), context)
                return _wants_certificate(address) if closed and not broker.client_cert else None
            _, writer = await asyncio.open_connection(host, int(port))
            writer.close()
        return await _hidden_tls(address, host, int(port))
    except ssl.SSLCertVerificationError as error:
        reason = error.verify_message.rstrip(".")
        if error.verify_code in OTHER_NAME:
            return f"{address}: {reason}; name the broker in --brokers as its certificate does"
        given = "" if broker.broker_ca is None else f", not {broker.broker_ca}"
        return (
            f"{address} has a certificate that is not trusted ({reason});"
            f" give that of its issuer as --broker-ca{given}"
        )
    except ssl.SSLError as error:
        if "CERTIFICATE_REQUIRED" in str(error) or "HANDSHAKE_FAILURE" in str(error):
            return _wants_certificate(address)
        return _no_tls(address)
    except TimeoutError:
        return _no_tls(address) if context is not None else f"{address} does not answer"
    except ConnectionResetError:
        return _no_tls(address) if context is not None else None
    except OSError as error:
        return f"{address}: {os.strerror(error.errno).lower() if error.errno else error}"


def _no_tls(address: str) -> str:
    return f"{address} does not answer by TLS: leave --tls out, or name the port that has it"


def _wants_certificate(address: str) -> str:
    return (
        f"{address} closes the connection: it may ask for a certificate of this client,"
        " --client-cert and --client-key"
    )


async def _closed_after_handshake(host: str, port: int, context: ssl.SSLContext) -> bool:
    """Shake hands, and return whether it is closed at once: with TLS 1.3 a missing certificate is noticed then."""
    reader, writer = await asyncio.open_connection(host, port, ssl=context)
    try:
        async with asyncio.timeout(_ALERT):
            return not await reader.read(1)
    except TimeoutError:
        return False
    except ConnectionResetError:
        return True
    finally:
        writer.close()


async def _hidden_tls(address: str, host: str, port: int) -> str | None:
    """Return that a broker speaks TLS, if it does; nothing is sent by the connection."""
    anybody = ssl.create_default_context()
    anybody.check_hostname, anybody.verify_mode = False, ssl.CERT_NONE
    try:
        async with asyncio.timeout(_PROBE):
            _, writer = await asyncio.open_connection(host, port, ssl=anybody)
    except OSError:  # TLS errors and time-outs are among them
        return None
    writer.close()
    return f"{address} speaks TLS: add --tls"
