"""Readers of the elements of a floor plan, each from its TOML table."""

from __future__ import annotations

from robot_sim.floorplan import toml_table as toml
from robot_sim.floorplan.plan import CloudSpec
from robot_sim.scene_objects.floor_surfaces import Patch, surface_named
from robot_sim.scene_objects.glazing import Glazing, Roof
from robot_sim.scene_objects.parcels import Parcel
from robot_sim.scene_objects.plan_elements import Door, Piece, Wall, Window
from robot_sim.scene_objects.ramps_and_steps import Slab
from robot_sim.scene_objects.terrain import Hill, LevelDisc, Rut, Terrain


def wall(table: toml.Table, index: int, height: float, thickness: float) -> Wall:
    """Read a ``[[wall]]``; height and thickness are the defaults."""
    result = Wall(
        name=table.take("name", toml.text, f"wall_{index}"),
        start=table.take("from", toml.point),
        end=table.take("to", toml.point),
        height=table.take("height", toml.number, height),
        thickness=table.take("thickness", toml.number, thickness),
        material=table.take("material", toml.text, "wall"),
        doors=tuple(_door(t) for t in table.tables("doors")),
        windows=tuple(_window(t) for t in table.tables("windows")),
    )
    table.close()
    return result


def _door(table: toml.Table) -> Door:
    door = Door(
        at=table.take("at", toml.number),
        width=table.take("width", toml.number),
        height=table.take("height", toml.number, 2.05),
    )
    table.close()
    return door


def _window(table: toml.Table) -> Window:
    window = Window(
        at=table.take("at", toml.number),
        width=table.take("width", toml.number),
        sill=table.take("sill", toml.number, 0.9),
        height=table.take("height", toml.number, 1.2),
    )
    table.close()
    return window


def piece(table: toml.Table, index: int) -> Piece:
    """Read a ``[[furniture]]``."""
    kind = table.take("type", toml.text)
    x, y = table.take("at", toml.point)
    result = Piece(
        name=table.take("name", toml.text, f"{kind}_{index}"),
        kind=kind,
        x=x,
        y=y,
        yaw=table.take("yaw", toml.degrees, 0.0),
        size=table.take("size", toml.size, None),
        seed=table.take("seed", toml.count, 0),
    )
    table.close()
    return result


def parcel(table: toml.Table, index: int) -> Parcel:
    """Read a ``[[parcel]]``."""
    x, y = table.take("at", toml.point)
    usual = Parcel("usual", 0.0, 0.0)
    result = Parcel(
        name=table.take("name", toml.text, f"parcel_{index}"),
        x=x,
        y=y,
        z=table.take("z", toml.number, usual.z),
        yaw=table.take("yaw", toml.degrees, usual.yaw),
        size=table.take("size", toml.size, usual.size),
        mass=table.take("mass", toml.number, usual.mass),
        material=table.take("material", toml.text, usual.material),
    )
    table.close()
    return result


def glazing(table: toml.Table, index: int, height: float) -> Glazing:
    """Read a ``[[glazing]]``; the height is the default."""
    result = Glazing(
        name=table.take("name", toml.text, f"glazing_{index}"),
        start=table.take("from", toml.point),
        end=table.take("to", toml.point),
        height=table.take("height", toml.number, height),
        plinth=table.take("plinth", toml.number, 0.3),
        spacing=table.take("spacing", toml.number, 1.5),
        doors=tuple(_door(t) for t in table.tables("doors")),
    )
    table.close()
    return result


def roof(table: toml.Table, index: int) -> Roof:
    """Read a ``[[roof]]``."""
    result = Roof(
        name=table.take("name", toml.text, f"roof_{index}"),
        bounds=table.take("bounds", toml.bounds),
        eaves=table.take("eaves", toml.number),
        ridge=table.take("ridge", toml.number),
        material=table.take("material", toml.text, "glass"),
        spacing=table.take("spacing", toml.number, 1.5),
    )
    table.close()
    return result


def slab(table: toml.Table, index: int) -> Slab:
    """Read a ``[[slab]]``."""
    x, y = table.take("at", toml.point)
    length, width = table.take("size", toml.area)
    result = Slab(
        name=table.take("name", toml.text, f"slab_{index}"),
        x=x,
        y=y,
        length=length,
        width=width,
        rise=table.take("top", toml.rise),
        yaw=table.take("yaw", toml.degrees, 0.0),
        surface=table.take("surface", toml.text, "concrete"),
        thickness=table.take("thickness", toml.number, None),
    )
    table.close()
    return result


def terrain(table: toml.Table, index: int) -> Terrain:
    """Read a ``[[terrain]]``."""
    result = Terrain(
        name=table.take("name", toml.text, f"terrain_{index}"),
        bounds=table.take("bounds", toml.bounds),
        cell=table.take("cell", toml.number, 0.25),
        height=table.take("height", toml.number, 0.05),
        skirt=table.take("skirt", toml.number, 1.0),
        roughness=table.take("roughness", toml.number, 0.05),
        wavelength=table.take("wavelength", toml.number, 4.0),
        seed=table.take("seed", toml.count, 0),
        surface=table.take("surface", toml.text, "grass"),
        hills=tuple(_hill(t) for t in table.tables("hills")),
        ruts=tuple(_rut(t) for t in table.tables("ruts")),
        levels=tuple(_level(t) for t in table.tables("levels")),
    )
    table.close()
    return result


def _hill(table: toml.Table) -> Hill:
    x, y = table.take("at", toml.point)
    hill = Hill(x, y, table.take("height", toml.number), table.take("radius", toml.number))
    table.close()
    return hill


def _rut(table: toml.Table) -> Rut:
    rut = Rut(
        path=table.take("path", toml.waypoints),
        width=table.take("width", toml.number, 0.3),
        depth=table.take("depth", toml.number, 0.05),
    )
    table.close()
    return rut


def _level(table: toml.Table) -> LevelDisc:
    x, y = table.take("at", toml.point)
    level = LevelDisc(x, y, table.take("radius", toml.number), table.take("height", toml.number))
    table.close()
    return level


def cloud(table: toml.Table) -> CloudSpec:
    """Read ``[cloud]``."""
    result = CloudSpec(
        spacing=table.take("spacing", toml.number, 0.08),
        highest=table.take("highest", toml.number, None),
    )
    table.close()
    return result


def patch(table: toml.Table) -> Patch:
    """Read a ``[[patch]]``."""
    x, y = table.take("at", toml.point)
    length, width = table.take("size", toml.area)
    result = Patch(
        surface=table.take("surface", lambda value: surface_named(toml.text(value))),
        x=x,
        y=y,
        half=(0.5 * length, 0.5 * width),
        yaw=table.take("yaw", toml.degrees, 0.0),
    )
    table.close()
    return result
