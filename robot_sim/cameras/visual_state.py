"""What a picture depends on at one instant: small enough to be sent to another process at every frame."""

from __future__ import annotations

from dataclasses import dataclass

from robot_sim.array_types import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class VisualState:
    """Positions of everything that moves, as MuJoCo's state has them; picklable."""

    stamp: int
    """Time since the start of the simulation [ns]."""
    qpos: FloatArray
    """Positions of all joints, (nq,), as ``MjData.qpos``."""
    mocap_pos: FloatArray
    """Positions of all mocap bodies [m], (nmocap, 3): people, doors, boxes that come at their time, spares."""
    mocap_quat: FloatArray
    """Attitudes of all mocap bodies, wxyz, (nmocap, 4)."""
