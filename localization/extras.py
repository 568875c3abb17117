"""Optional libraries: the extra that installs each, and the command that does so on this machine."""

from __future__ import annotations

import shlex
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from localization.errors import LocalizationError

EXTRAS: Final = {
    "OpenGL": "camera",
    "aiokafka": "kafka",
    "aiortc": "webrtc",
    "av": "webrtc",
    "cryptography": "lan",
    "segno": "lan",
    "cbor2": "wire",
    "daqp": "arm",
    "dask": "sweep",
    "distributed": "sweep",
    "embreex": "sim",
    "h11": "wire",
    "hypothesis": "fuzz",
    "matplotlib": "report",
    "mujoco": "sim",
    "msgspec": "wire",
    "open3d": "map",
    "pyarrow": "sweep",
    "pybase64": "wire",
    "pydantic": "sim",
    "pygame": "gamepad",
    "rerun": "operator",
    "rerun_bindings": "operator",
    "ruckig": "arm",
    "serial": "servos",
    "tornado": "kafka",
    "websockets": "wire",
}
"""Optional libraries by import name, with the extra of ``farsteer`` that installs each."""


class MissingLibraryError(LocalizationError, ImportError):
    """An optional library is not installed; the message is the command that installs it."""


def has(library: str) -> bool:
    """Return whether a library can be imported, without importing it."""
    try:
        return find_spec(library) is not None
    except ValueError:  # an entry of sys.modules without a specification: it is blocked
        return False


def missing(library: str, purpose: str = "") -> str:
    """Return one line that names a missing library, what needs it, and the command that installs it.

    Args:
        library: Name by which the library is imported.
        purpose: What needs it, such as ``building a map``; empty if that is clear.
    """
    reason = f"{purpose} needs {library}" if purpose else f"{library} is missing"
    return f"{reason}: {install_command(EXTRAS[library])}"


def require(library: str, purpose: str = "") -> None:
    """Check that an optional library is installed, before any work is done.

    Args:
        library: Name by which the library is imported.
        purpose: What needs it, for the message.

    Raises:
        MissingLibraryError: If it is not installed.
    """
    if not has(library):
        raise MissingLibraryError(missing(library, purpose))


def install_command(extra: str) -> str:
    """Return the command that adds an extra of ``farsteer`` to the running environment.

    ``farsteer`` is on no package index, so it installs from the clone that the running installation came from.
    Without one, the command is to be run in a clone.
    """
    pip = Path(sys.executable).with_name("pip")
    words = [_short(pip)] if pip.exists() else [_short(Path(sys.executable)), "-m", "pip"]
    source = _clone()
    if source is None:
        return f"in a clone of farsteer, {shlex.join([*words, 'install', f'.[{extra}]'])}"
    clone, editable = source
    words += ["install", "--constraint", _short(clone / "constraints.txt")]
    place = _short(clone)
    # A name that begins with neither a dot nor a slash would be a distribution of an index.
    place = place if place[0] in "./" else f"./{place}"
    return shlex.join([*words, *(["--editable"] if editable else []), f"{place}[{extra}]"])


def _clone() -> tuple[Path, bool] | None:
    """Return the clone that this installation runs from or was made from, and whether it runs from it."""
    beside = Path(__file__).resolve().parents[1]
    if (beside / "pyproject.toml").is_file():
        return beside, True
    import json
    from importlib.metadata import PackageNotFoundError, distribution
    from urllib.parse import unquote, urlsplit

    try:
        # PEP 610: where pip took the distribution from.
        origin = json.loads(distribution("farsteer").read_text("direct_url.json") or "{}")
    except PackageNotFoundError:
        return None
    clone = Path(unquote(urlsplit(origin.get("url", "")).path))
    return (clone, False) if (clone / "constraints.txt").is_file() else None


def _short(path: Path) -> str:
    """Return a path as it is written in the present folder."""
    try:
        return str(path.relative_to(Path.cwd()))
    except ValueError:
        return str(path)
