"""The map that the robot serves: fetched once by its hash over HTTP, verified, and kept."""

from __future__ import annotations

import asyncio
import hashlib
import http.client
import ssl
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from localization.maps.cloud import Cloud
from localization.maps.map_cache import default_cache
from localization.maps.map_files import load_cloud
from teleop.errors import TeleopError

PAGE: Final = "/map.ply"
"""Path of the map on the robot's HTTP server, which is that of the WebSocket."""
LARGEST: Final = 2_000_000_000
"""Size of the largest map that is fetched [bytes]: 80 million points."""
KEPT: Final = 2_000_000_000
"""Greatest size of the maps that are kept [bytes]; the least recently used ones are deleted."""
_CHUNK: Final = 1 << 18
_TIMEOUT: Final = 20.0
"""Time without a byte after which a download is given up [s]."""


class MapDownloadError(TeleopError):
    """The robot's map cannot be had; the message is one line."""


class MapLibrary:
    """Maps by their hashes: the operator's own file, those that were fetched before, and the robot's."""

    def __init__(
        self,
        url: str,
        *,
        own: Path | None = None,
        token: str | None = None,
        tls: ssl.SSLContext | None = None,
        folder: Path | None = None,
    ) -> None:
        """Choose where maps come from and where they are kept.

        Args:
            url: Address of the robot's WebSocket.
            own: A file of the operator's, which is used if it has the wanted hash.
            token: Token that is sent along.
            tls: Trusted certificates for ``wss://`` addresses; those of the system by default.
            folder: Folder for fetched maps; that of the user by default.
        """
        self._url, self._own, self._token, self._tls = url, own, token, tls
        self._folder = folder or default_cache() / "maps"

    async def load(self, sha256: str) -> tuple[Cloud, str]:
        """Return the cloud with a hash, and where it came from in words.

        Raises:
            MapDownloadError: If there is no file with this hash.
            CloudError: If the file is no cloud.
        """
        return await asyncio.to_thread(self._load, sha256)

    def _load(self, sha256: str) -> tuple[Cloud, str]:
        if len(sha256) != 64 or not set(sha256) <= set("0123456789abcdef"):
            raise MapDownloadError("the robot's map has no hash, so that no file can be compared")
        if self._own is not None and _hash_of(self._own) == sha256:
            return load_cloud(self._own), str(self._own)
        kept = self._folder / f"{sha256}.ply"
        where = "kept from an earlier time"
        if _hash_of(kept) != sha256:
            self._fetch(sha256, kept)
            where = "fetched from the robot"
        else:
            with suppress(OSError):
                kept.touch()  # the time of the last use decides which is deleted first
        if self._own is not None:
            where += f", since {self._own} is another map"
        return load_cloud(kept), where

    def _fetch(self, sha256: str, kept: Path) -> None:
        """Fetch the robot's map into a file, under its name only once its hash is right."""
        self._folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=self._folder, suffix=".part", delete=False) as out:
            part = Path(out.name)
            digest = hashlib.sha256()
            try:
                for chunk in self._chunks():
                    digest.update(chunk)
                    out.write(chunk)
                out.flush()
                if digest.hexdigest() != sha256:
                    raise MapDownloadError(
                        f"{PAGE} of the robot has hash {digest.hexdigest()[:12]}, its map {sha256[:12]}: not used"
                    )
                part.replace(kept)
            finally:
                part.unlink(missing_ok=True)
        self._tidy(kept)

    def _chunks(self) -> Iterator[bytes]:
        address = urlsplit(self._url)
        host, secure = address.hostname or "", address.scheme in ("wss", "https")
        connection: http.client.HTTPConnection
        if secure:
            tls = self._tls or ssl.create_default_context()
            connection = http.client.HTTPSConnection(
                host, address.port, timeout=_TIMEOUT, context=tls
            )
        else:
            connection = http.client.HTTPConnection(host, address.port, timeout=_TIMEOUT)
        headers = {} if self._token is None else {"Authorization": f"Bearer {self._token}"}
        try:
            connection.request("GET", PAGE, headers=headers)
            answer = connection.getresponse()
            if answer.status != http.HTTPStatus.OK:
                raise MapDownloadError(
                    f"the robot does not serve {PAGE}: {answer.status} {answer.reason}"
                )
            size = 0
            while chunk := answer.read(_CHUNK):
                size += len(chunk)
                if size > LARGEST:
                    raise MapDownloadError(f"{PAGE} of the robot is larger than {LARGEST} bytes")
                yield chunk
        except (OSError, http.client.HTTPException) as error:
            why = str(error) or type(error).__name__
            raise MapDownloadError(f"cannot fetch {PAGE} from the robot: {why}") from None
        finally:
            connection.close()

    def _tidy(self, spare: Path) -> None:
        """Delete the maps used least recently until the rest is within a bound."""
        files = []
        for file in self._folder.glob(f"{'[0-9a-f]' * 64}.ply"):
            with suppress(OSError):
                known = file.stat()
                files.append((known.st_mtime_ns, known.st_size, file))
        total = sum(size for _, size, _ in files)
        for _, size, file in sorted(files, key=lambda f: f[0]):
            if total > KEPT and file != spare:
                with suppress(OSError):
                    file.unlink()
                total -= size


def _hash_of(file: Path) -> str | None:
    """Return the hash of a file; None if it cannot be read."""
    try:
        with file.open("rb") as data:
            return hashlib.file_digest(data, "sha256").hexdigest()
    except OSError:
        return None
