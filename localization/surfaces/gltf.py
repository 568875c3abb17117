"""A building as a binary glTF file (GLB 2.0), which viewers, Unity and three.js open.

A writer of its own: what is needed of the format is one table and four arrays a mesh, and libraries that write it
bring a scene graph along. Specification: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html.

glTF's y axis points up, so one node turns the map's z axis there. Colours are fixed, shaded by the direction of the
face, and need no light (``KHR_materials_unlit``): they look alike on every machine. ``_BOTTOM`` is the height above
the floor of the lower edge of each vertex's face, so that a display which cuts the walls can leave out what begins
above the cut, such as lintels.
"""

from __future__ import annotations

import io
import json
import struct
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from PIL import Image

from localization.geometry import FloatArray
from localization.surfaces.building import Building
from localization.surfaces.faces import Faces
from localization.surfaces.floor import Floor

_WALL, _WALL_TOP = (0.80, 0.82, 0.84), (0.27, 0.30, 0.34)
_FURNITURE, _FURNITURE_TOP = (0.66, 0.56, 0.44), (0.78, 0.68, 0.55)
_FLOOR_GREY: Final = 222
_SUN: Final = np.array([0.8, 0.6])
"""Where the light comes from, seen from above."""
_FLOAT, _BYTE, _SHORT, _INT = 5126, 5121, 5123, 5125
_VERTICES, _INDICES = 34962, 34963


def glb(building: Building, *, name: str = "", sha256: str = "") -> bytes:
    """Return the building as the bytes of a GLB file.

    Args:
        building: Its surfaces.
        name: Name of the map.
        sha256: Hash of the map they were computed from; a display compares it with its own map's.
    """
    file = _File()
    walls, furniture = building.walls, building.furniture
    file.add_quads("walls", [_sides(walls, _WALL), _tops(walls.only(walls.wide()), _WALL_TOP)])
    low = (
        building.tops,
        np.tile(_FURNITURE_TOP, (len(building.tops), 1)),
        np.zeros(len(building.tops)),
    )
    file.add_quads("furniture", [_sides(furniture, _FURNITURE), low])
    if building.floor is not None:
        file.add_floor(building.floor)
    return file.content({"map": name, "sha256": sha256, "wall_height": building.wall_height})


Quads = tuple[FloatArray, FloatArray, FloatArray]
"""Corners (N, 4, 3) [m], colours (N, 3) from 0 to 1, and heights (N,) above the floor where each begins [m]."""


def _sides(faces: Faces, colour: tuple[float, float, float]) -> Quads:
    light = 0.82 + 0.18 * (faces.normal @ _SUN)
    return faces.upright_corners(), light[:, None] * np.array(colour), faces.bottom


def _tops(faces: Faces, colour: tuple[float, float, float]) -> Quads:
    return faces.top_corners(), np.tile(colour, (len(faces.top), 1)), faces.bottom


class _File:
    """A GLB file under construction: its table, and the bytes of its arrays."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._meshes: list[dict[str, Any]] = []
        self._images: list[dict[str, Any]] = []

    def add_quads(self, name: str, quads: list[Quads]) -> None:
        """Add a mesh of quads with a colour each."""
        corners, colours, bottoms = (np.concatenate(part) for part in zip(*quads, strict=True))
        if len(corners) == 0:
            return
        first = 4 * np.arange(len(corners), dtype=np.int64)[:, None]
        colour = np.full((len(corners), 4), 255, dtype=np.uint8)
        colour[:, :3] = np.round(255.0 * colours**2.2)  # glTF's vertex colours are linear
        attributes = {
            "POSITION": self._positions(corners.reshape(-1, 3)),
            "COLOR_0": self._array(np.repeat(colour, 4, axis=0), _BYTE, "VEC4", normalized=True),
            "_BOTTOM": self._array(np.repeat(bottoms, 4).astype(np.float32), _FLOAT, "SCALAR"),
        }
        self._add_mesh(name, attributes, first + np.array([0, 1, 2, 0, 2, 3]), material=0)

    def add_floor(self, floor: Floor) -> None:
        """Add the floor, with its image of what is known."""
        vertices, places, triangles = floor.mesh()
        grey = np.full(floor.known.T.shape, _FLOOR_GREY, dtype=np.uint8)
        picture = Image.merge(
            "LA", [Image.fromarray(a) for a in (grey, 255 * floor.known.T.astype(np.uint8))]
        )
        out = io.BytesIO()
        picture.save(out, "PNG", optimize=True)
        self._images.append({"bufferView": self._view(out.getvalue()), "mimeType": "image/png"})
        attributes = {
            "POSITION": self._positions(vertices),
            "TEXCOORD_0": self._array(places.astype(np.float32), _FLOAT, "VEC2"),
        }
        self._add_mesh("floor", attributes, triangles, material=1)

    def content(self, extras: dict[str, Any]) -> bytes:
        """Return the file's bytes."""
        unlit = {"extensions": {"KHR_materials_unlit": {}}, "doubleSided": True}
        # glTF's y is the map's z, and its z the map's -y: a quarter turn about x.
        up = {"name": "map", "rotation": [-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]}
        table: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "farsteer", "extras": extras},
            "extensionsUsed": ["KHR_materials_unlit"],
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [up, *({"name": m["name"], "mesh": i} for i, m in enumerate(self._meshes))],
            "materials": [{"name": "surfaces", **unlit}],
        }
        if self._meshes:
            table["nodes"][0]["children"] = list(range(1, len(self._meshes) + 1))
            table |= {"meshes": self._meshes, "accessors": self._accessors}
            table |= {"bufferViews": self._views, "buffers": [{"byteLength": len(self._bytes)}]}
        if self._images:
            colour = {"baseColorTexture": {"index": 0}}
            floor = {"name": "floor", "alphaMode": "MASK", "pbrMetallicRoughness": colour, **unlit}
            table["materials"].append(floor)
            table |= {"images": self._images, "textures": [{"source": 0, "sampler": 0}]}
            table["samplers"] = [
                {"wrapS": 33071, "wrapT": 33071}
            ]  # the edge's colour beyond the edge
        text = json.dumps(table, separators=(",", ":")).encode()
        chunks = _chunk(b"JSON", text, b" ") + _chunk(b"BIN\0", bytes(self._bytes), b"\0")
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def _add_mesh(
        self,
        name: str,
        attributes: dict[str, int],
        triangles: npt.NDArray[np.int64],
        *,
        material: int,
    ) -> None:
        wide = triangles.max() > 65534
        flat = triangles.ravel().astype(np.uint32 if wide else np.uint16)
        indices = self._array(flat, _INT if wide else _SHORT, "SCALAR", target=_INDICES)
        part = {"attributes": attributes, "indices": indices, "material": material}
        self._meshes.append({"name": name, "primitives": [part]})

    def _positions(self, points: FloatArray) -> int:
        rounded = points.astype(np.float32)
        low, high = rounded.min(axis=0).tolist(), rounded.max(axis=0).tolist()
        return self._array(rounded, _FLOAT, "VEC3", min=low, max=high)

    def _array(
        self,
        values: npt.NDArray[Any],
        kind: int,
        shape: str,
        *,
        target: int = _VERTICES,
        **more: Any,
    ) -> int:
        view = self._view(values.tobytes(), target=target)
        more |= {"bufferView": view, "componentType": kind, "count": len(values), "type": shape}
        self._accessors.append(more)
        return len(self._accessors) - 1

    def _view(self, content: bytes, **more: Any) -> int:
        self._views.append(
            {"buffer": 0, "byteOffset": len(self._bytes), "byteLength": len(content), **more}
        )
        self._bytes += content + bytes(-len(content) % 4)
        return len(self._views) - 1


def _chunk(kind: bytes, content: bytes, filler: bytes) -> bytes:
    content += filler * (-len(content) % 4)
    return struct.pack("<I4s", len(content), kind) + content
