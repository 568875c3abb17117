"""Import of Open3D, which is optional and slow to load."""

from __future__ import annotations

from types import ModuleType


def import_open3d() -> ModuleType:
    """Return the module Open3D, which takes a second or more to load.

    Raises:
        ImportError: If it is missing or does not load; the message names the package to install.
    """
    try:
        import open3d
    except ModuleNotFoundError as error:
        raise ImportError("building a map needs Open3D: pip install 'farsteer[map]'") from error
    except ImportError as error:
        raise ImportError(
            f"Open3D does not load ({error}); "
            "on Debian: apt-get install libegl1 libgl1 libx11-6 libidn2-0 libusb-1.0-0"
        ) from error
    module: ModuleType = open3d
    return module
