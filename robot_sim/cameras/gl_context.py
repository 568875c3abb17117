"""An OpenGL context without a display, from EGL or OSMesa.

``MUJOCO_GL=egl`` or ``osmesa`` chooses; anything else (simulations set ``disable``) takes EGL, or OSMesa where there is no EGL. A context
belongs to the thread that made it.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import sys
from collections.abc import Iterator
from ctypes.util import find_library
from importlib.util import find_spec
from typing import Any, Final

import mujoco

from robot_sim.errors import CameraUnavailableError

BACKENDS: Final = ("egl", "osmesa")
"""Ways to draw without a display, the preferred one first."""
_LIBRARIES: Final = {"egl": "EGL", "osmesa": "OSMesa"}
_PACKAGES: Final = "libegl1 libgl1 (EGL), or libosmesa6 (OSMesa)"
_THREADS: Final = "LP_NUM_THREADS"
"""Environment variable that sets how many threads Mesa's software renderer starts."""


class OffscreenContext:
    """MuJoCo's drawing context for one model, with the OpenGL context it needs."""

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        """Make both current in this thread.

        Args:
            model: The model; its meshes and textures are uploaded.
            width: Width of the framebuffer [pixels].
            height: Height of the framebuffer [pixels].

        Raises:
            CameraUnavailableError: There is neither EGL nor OSMesa; the message names the packages.
        """
        self._gl: Any = None
        # Without threads of its own Mesa draws in ours: no more processors than asked for.
        os.environ.setdefault(_THREADS, "0")
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        if find_spec("OpenGL") is None:
            raise CameraUnavailableError(
                "no camera can be drawn without PyOpenGL: install farsteer[camera], and Debian's packages"
                f" {_PACKAGES}"
            )
        reasons = []
        for backend in _wanted_backends():
            try:
                self._gl, self.mjr = _open(backend, model, width, height)
            except Exception as error:  # libraries that are missing fail in many ways
                reasons.append(f"{backend}: {' '.join(str(error).split()) or repr(error)}")
            else:
                self.backend = backend
                """The backend that draws."""
                return
        raise CameraUnavailableError(
            "no camera can be drawn on this machine: it needs Debian's packages"
            f" {_PACKAGES} ({'; '.join(reasons)})"
        )

    def make_current(self) -> None:
        """Make the context current in this thread, which must be the one that made it."""
        self._gl.make_current()

    def __del__(self) -> None:
        """Free what was not closed: MuJoCo would free the same names of whichever context is current then."""
        if not sys.is_finalizing():
            self.close()

    def close(self) -> None:
        """Free the context."""
        if getattr(self, "_gl", None) is not None:
            with self._gl.as_current():
                self.mjr.free()
            self._gl.free()
            self._gl = None


def _wanted_backends() -> tuple[str, ...]:
    chosen = os.environ.get("MUJOCO_GL", "").strip().lower()
    if chosen in BACKENDS:
        return (chosen,)
    # PyOpenGL holds to the first that it tries, so the second is of no use after it.
    there = tuple(backend for backend in BACKENDS if find_library(_LIBRARIES[backend]))
    return there[:1] or BACKENDS


def _open(backend: str, model: mujoco.MjModel, width: int, height: int) -> tuple[Any, Any]:
    with _environment(MUJOCO_GL=backend, PYOPENGL_PLATFORM=backend):
        gl = importlib.import_module(f"mujoco.{backend}").GLContext(width, height)
        try:
            gl.make_current()
            # MuJoCo finds OpenGL's functions by the variable.
            mjr = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50)
        except BaseException:
            gl.free()
            raise
    mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, mjr)
    mjr.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
    return gl, mjr


@contextlib.contextmanager
def _environment(**variables: str) -> Iterator[None]:
    before = {key: os.environ.get(key) for key in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for key, value in before.items():
            if value is None:
                os.environ.pop(key, None)
            else:
                os.environ[key] = value
