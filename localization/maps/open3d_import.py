"""Import of Open3D, which is optional and slow to load."""

from __future__ import annotations

from types import ModuleType

from localization.extras import require


def import_open3d() -> ModuleType:
    """Return the module Open3D, which takes a second or more to load.

    Raises:
        MissingLibraryError: If it is not installed; the message is the command that installs it.
        ImportError: If it does not load; the message names the system's packages that it wants.
    """
    require("open3d", "building a map")
    try:
        import open3d
    except ImportError as error:
        raise ImportError(
            f"Open3D does not load ({error}); "
            "on Debian: apt-get install libegl1 libgl1 libx11-6 libidn2-0 libusb-1.0-0"
        ) from error
    module: ModuleType = open3d
    return module
