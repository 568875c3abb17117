"""MuJoCo contact sensors on the robot's parts, which count contacts in every physics step.

A tick is rolled out in one native call, and of its steps only sensor data are kept. Each part therefore
has a contact sensor; where a count is positive, the contacts of that step are computed again.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import mujoco

_FOUND: Final = 1 << int(mujoco.mjtConDataField.mjCONDATA_FOUND)
_LOWEST: Final = 1
"""Reduction of the sensor's contacts to the deepest one."""


def add_contact_sensors(spec: mujoco.MjSpec, body: str, wheels: tuple[str, ...]) -> None:
    """Add a contact sensor for the hull, for each wheel's hull and for each tyre.

    Args:
        spec: Specification that contains the robot.
        body: Name of the body of the robot's hull, without its wheels.
        wheels: Names of the wheels; the geoms are ``<wheel>_hull`` and ``<wheel>_tyre``.
    """
    _add(spec, f"{body}_touch", mujoco.mjtObj.mjOBJ_BODY, body)
    for part in ("hull", "tyre"):
        for wheel in wheels:
            name = f"{wheel}_{part}"
            _add(spec, f"{name}_touch", mujoco.mjtObj.mjOBJ_GEOM, name)


def _add(spec: mujoco.MjSpec, name: str, kind: mujoco.mjtObj, part: str) -> None:
    sensor = spec.add_sensor(
        name=name, type=mujoco.mjtSensor.mjSENS_CONTACT, objtype=kind, objname=part
    )
    sensor.intprm[0], sensor.intprm[1], sensor.intprm[2] = _FOUND, _LOWEST, 1


@dataclass(frozen=True, slots=True)
class ContactSensorColumns:
    """Columns of the contact counts in the sensor data."""

    hull: slice
    """Columns of the hull and of the wheels' hulls: 1 + number of wheels."""
    tyres: slice
    """One column per wheel, in their order."""

    @classmethod
    def of(cls, model: mujoco.MjModel, body: str, wheels: tuple[str, ...]) -> ContactSensorColumns:
        """Look the columns up by name."""
        first = int(model.sensor(f"{body}_touch").adr[0])
        tyres = int(model.sensor(f"{wheels[0]}_tyre_touch").adr[0])
        return cls(slice(first, first + 1 + len(wheels)), slice(tyres, tyres + len(wheels)))
