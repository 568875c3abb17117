"""``farsteer surfaces``: a map's walls, floor and furniture as a glTF file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from localization.cli.run_folder import check_file
from localization.cli.terminal import say


@dataclass(frozen=True)
class Surfaces:
    """Write a map's walls with their openings, its floor and its furniture as a glTF file.

    Blender, Unity, three.js and the viewers of operating systems open it. A running robot serves its own as /map.glb.
    Walls of a flat map get a height of 1.2 m.
    """

    map: Annotated[Path, tyro.conf.Positional]
    """A cloud (.ply, .pcd, .xyz) or a ROS occupancy grid (map.yaml)."""
    out: Path | None = None
    """File to write, a .glb; by default beside the map."""
    overwrite: bool = False
    """Replace the file if it is there."""

    def __call__(self) -> int:
        """Run it."""
        out = self.out if self.out is not None else self.map.with_suffix(".glb")
        if self.map.exists():
            check_file(out, overwrite=self.overwrite)

        from localization.maps.map_cache import default_cache
        from localization.maps.map_files import load_map
        from localization.surfaces.building import building_of
        from localization.surfaces.gltf import glb

        cloud = load_map(self.map, cache=default_cache())
        building = building_of(cloud)
        content = glb(building, name=cloud.name, sha256=cloud.sha256)
        out.write_bytes(content)
        walls, rest = len(building.walls.top), len(building.furniture.top) + len(building.tops)
        given = building.wall_height
        height = "" if given is None else f" of {given:g} m, as the map says no height"
        floor = "no floor was seen" if building.floor is None else "the floor"
        say(
            f"{out}: {walls} faces of walls{height}, {rest} of furniture, {floor}; {len(content) / 1e3:.0f} kB"
        )
        return 0
