"""Where a sweep is computed: processes of this machine, or the workers of a Dask scheduler elsewhere."""

from __future__ import annotations

import asyncio
import ipaddress
import logging
import os
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlsplit

from localization.extras import require
from teleop.errors import SettingError
from teleop.scenario.sweeps.running import deciding_versions

if TYPE_CHECKING:
    from distributed import Client, Security

_PATIENCE: Final = 10.0
"""Time within which a scheduler must answer, and have a worker [s]."""
_LOCAL: Final = ("localhost", "ip6-localhost")


@dataclass(frozen=True, slots=True)
class Workers:
    """Where the runs are computed."""

    count: int | None = None
    """Number of processes on this machine; as many as it has cores, unless given."""
    address: str = ""
    """Address of a Dask scheduler, such as ``tls://host:8786``; processes of this machine without one."""
    tls: tuple[Path, Path, Path] | None = None
    """Certificate of the authority, own certificate, and own key, for ``tls://``; those of Dask's own
    configuration, unless given."""

    def __post_init__(self) -> None:
        if self.count is not None and self.count < 1:
            raise SettingError(f"--workers must be >= 1, got {self.count}")
        if self.address and self.count is not None:
            raise SettingError("--workers are started on this machine; --dask has workers already")
        if self.address:
            _check_address(self.address)
        if self.tls is not None and not self.address.startswith("tls://"):
            raise SettingError("--tls-ca-file, --tls-cert and --tls-key are for --dask tls://...")


def _check_address(address: str) -> None:
    """Refuse an address that is not encrypted, but for one on this machine: workers run what they are sent."""
    parts = urlsplit(address)
    try:
        port = parts.port
    except ValueError:
        port = None
    if parts.scheme not in ("tls", "tcp") or not parts.hostname or not port:
        raise SettingError(f"--dask {address}: give tls://HOST:PORT, or tcp://127.0.0.1:PORT")
    if parts.scheme == "tcp" and not _is_local(parts.hostname):
        raise SettingError(
            f"--dask {address}: only tls:// leaves this machine, for anybody who reaches a scheduler"
            " can have its workers run any program"
        )


def _is_local(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host in _LOCAL


@contextmanager
def client_of(workers: Workers, runs: int) -> Iterator[Client]:
    """Connect to a scheduler, or start one with its workers, and end what was started.

    Args:
        workers: Where the runs are computed.
        runs: Number of runs: no more processes than that are started.

    Raises:
        SettingError: If no scheduler answers, or its workers would compute other bits than this process.
    """
    import dask
    from distributed import Client, LocalCluster

    with ExitStack() as stack:
        if workers.address:
            security = _security(workers)
            # Whatever happens to the connection is said in one line.
            for name in ("distributed", "distributed.client"):
                logging.getLogger(name).setLevel(logging.CRITICAL)
            try:
                client = Client(workers.address, security=security, timeout=_PATIENCE)
            except OSError as error:
                raise SettingError(
                    f"--dask {workers.address}: no scheduler answers: {error}"
                ) from None
            stack.enter_context(client)
            _silence_abandoned_waits(client)
            _check_workers(client, workers.address)
            yield client
            return
        scratch = stack.enter_context(tempfile.TemporaryDirectory(prefix="farsteer-sweep-"))
        stack.enter_context(dask.config.set(_QUIET))
        cluster = LocalCluster(
            n_workers=min(workers.count or len(os.sched_getaffinity(0)), runs),
            threads_per_worker=1,
            host="127.0.0.1",
            # Others on this machine could connect as well, and have the workers run what they like.
            protocol="tls://",
            security=_own_security(),
            dashboard_address="127.0.0.1:0",
            local_directory=scratch,
            memory_limit=0,
            preload=["teleop.scenario.sweeps.worker_preload"],
            silence_logs=logging.CRITICAL,
        )
        stack.enter_context(cluster)
        client = stack.enter_context(Client(cluster, security=cluster.security))
        _silence_abandoned_waits(client)
        yield client


def _silence_abandoned_waits(client: Client) -> None:
    """Keep Dask from printing tracebacks of waits that timed out here and ended later."""
    from distributed.client import AllExit

    def handle(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        if not isinstance(context.get("exception"), AllExit):
            loop.default_exception_handler(context)

    async def install() -> None:
        asyncio.get_running_loop().set_exception_handler(handle)

    client.sync(install)


def _check_workers(client: Client, address: str) -> None:
    """Refuse a cluster without workers, and one whose workers would compute other bits than this process."""
    try:
        client.wait_for_workers(1, timeout=_PATIENCE)
        held: dict[str, dict[str, str]] = client.run(deciding_versions)
    except TimeoutError:
        raise SettingError(f"--dask {address}: the scheduler has no workers") from None
    except ModuleNotFoundError as error:
        raise SettingError(
            f"--dask {address}: its workers have no {error.name}; they need farsteer with the extra sweep"
        ) from None
    own = deciding_versions()
    for worker, versions in held.items():
        if different := [name for name in own if versions.get(name) != own[name]]:
            raise SettingError(
                f"--dask {address}: worker {worker} has another version of {', '.join(different)}, which may"
                " give other bits"
            )


_QUIET: Final[dict[str, list[str]]] = {
    # Nothing over HTTP, where everybody on this machine could look.
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
}


def _own_security() -> Security:
    """Return certificates that live as long as this process."""
    require("cryptography", "a sweep")
    from distributed import Security

    security: Security = Security.temporary()
    return security


def _security(workers: Workers) -> Security | None:
    from distributed import Security

    if not workers.address.startswith("tls://"):
        return None
    if workers.tls is None:
        security = Security(require_encryption=True)
        if not security.get_tls_config_for_role("client").get("ca_file"):
            raise SettingError(
                f"--dask {workers.address}: give --tls-ca-file, --tls-cert and --tls-key, or set"
                " distributed.comm.tls in Dask's configuration"
            )
        return security
    for file in workers.tls:
        file.open("rb").close()
    authority, certificate, key = map(str, workers.tls)
    return Security(
        tls_ca_file=authority,
        tls_client_cert=certificate,
        tls_client_key=key,
        require_encryption=True,
    )
