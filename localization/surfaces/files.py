"""Files of surfaces: computed once for each map, and kept under its hash."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from localization.maps.cloud import Cloud
from localization.maps.map_cache import load_bytes, store_bytes
from localization.surfaces.building import building_of
from localization.surfaces.gltf import glb

_VERSION: Final = 1
"""Part of a file's name; it changes with the meaning of the file's content."""


def surfaces_of(cloud: Cloud, *, cache: Path | None = None) -> bytes:
    """Return the surfaces of a cloud as the bytes of a GLB file.

    Args:
        cloud: The map.
        cache: Folder for derived files, read if it holds this cloud's; None keeps no file.
    """
    file = None
    if cache is not None and cloud.sha256:
        file = cache / f"{cloud.sha256[:24]}-surfaces-v{_VERSION}.glb"
        kept = load_bytes(file)
        if kept is not None:
            return kept
    content = glb(building_of(cloud), name=cloud.name, sha256=cloud.sha256)
    if file is not None:
        store_bytes(file, content)
    return content
