"""mink as a follower of hands, as its documents set it up, for the figures of the arm."""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from benchmarks.arm.paths import TABLE, TICK
from localization.geometry import FloatArray, quaternion_from_rotation
from robot_sim.arm.body import add_arm

INSTALL: Final = "mink is missing: .venv/bin/pip install --no-deps mink==1.3.0 qpsolvers"
"""Without its dependencies, since it wants the package of MuJoCo with the viewer, which would replace ours."""
WAYS: Final = {
    "mink, full orientation": ((1.0, 1.0, 1.0), 0.0),
    "mink, pointing, damping 0.01": ((0.0, 0.1, 0.1), 0.01),
    "mink, pointing, damping 1": ((0.0, 0.1, 0.1), 1.0),
}
"""Cost of a frame's orientation about its axes, and damping: as usual, and as is best for this arm."""


class Mink:
    """A configuration with a task for the tip; ``step`` takes it on by a tick."""

    def __init__(self, angles: FloatArray, way: str) -> None:
        """Begin at angles (5,) [rad].

        Raises:
            ImportError: If mink is not installed.
        """
        import mink

        spec = mujoco.MjSpec()
        add_arm(spec, spec.worldbody.add_body(name="base_link"), TABLE, "bracket")
        model = spec.compile()
        self._rows = [int(model.joint(joint.name).qposadr[0]) for joint in TABLE.joints]
        start = np.zeros(model.nq)
        start[self._rows] = angles
        self._mink, self._mount = mink, TABLE.mount("bracket")
        self._configuration = mink.Configuration(model, start)
        cost, damping = WAYS[way]
        self._task = mink.FrameTask("tool0", "body", 1.0, np.array(cost), lm_damping=damping)
        posture = mink.PostureTask(model, cost=1e-4)
        posture.set_target(start)
        self._tasks = [self._task, posture]
        speeds = {joint.name: TABLE.motion.speed for joint in TABLE.joints}
        self._limits = [mink.ConfigurationLimit(model), mink.VelocityLimit(model, speeds)]

    @property
    def angles(self) -> FloatArray:
        """Angles (5,) now [rad]."""
        found: FloatArray = self._configuration.q[self._rows]
        return found

    def step(self, tip: FloatArray) -> FloatArray:
        """Go on towards ``arm_base_from_tool0`` (4, 4) for a tick; return the angles (5,) [rad]."""
        mount = self._mount
        place = mount.position + mount.rotation @ tip[:3, 3]
        turn = quaternion_from_rotation(mount.rotation @ tip[:3, :3])
        self._task.set_target(self._mink.SE3(np.concatenate([turn, place])))
        velocity = self._mink.solve_ik(
            self._configuration, self._tasks, TICK, "daqp", limits=self._limits
        )
        self._configuration.integrate_inplace(velocity, TICK)
        return self.angles
