"""Where nothing can be drawn, one line says what is missing; the rest of the robot does not notice."""

from __future__ import annotations

import os
import subprocess
import sys

import mujoco
import pytest

from robot_sim.cameras import gl_context
from robot_sim.cameras.gl_context import OffscreenContext
from robot_sim.errors import CameraUnavailableError, SimulationError

MODEL = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"


def test_without_graphics_libraries_the_message_names_the_packages(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def missing(name: str) -> None:
        raise OSError(f"lib{name}.so: cannot open\nshared object file")

    monkeypatch.setattr("importlib.import_module", missing)
    monkeypatch.setattr(gl_context, "find_library", lambda _: None)
    monkeypatch.setenv("MUJOCO_GL", "disable")
    model = mujoco.MjModel.from_xml_string(MODEL)

    with pytest.raises(CameraUnavailableError) as caught:
        OffscreenContext(model, 32, 32)

    message = str(caught.value)
    assert "libegl1 libgl1" in message
    assert "libosmesa6" in message
    assert "egl: libmujoco.egl.so" in message
    assert "osmesa: " in message
    assert "\n" not in message
    assert isinstance(caught.value, SimulationError)
    assert os.environ["MUJOCO_GL"] == "disable"


def test_only_the_chosen_backend_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[str] = []

    def missing(name: str) -> None:
        tried.append(name)
        raise ImportError(name)

    monkeypatch.setattr("importlib.import_module", missing)
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    with pytest.raises(CameraUnavailableError):
        OffscreenContext(mujoco.MjModel.from_xml_string(MODEL), 32, 32)

    assert tried == ["mujoco.osmesa"]


@pytest.mark.parametrize(
    ("there", "expected"), [({"EGL", "OSMesa"}, "egl"), ({"OSMesa"}, "osmesa")]
)
def test_the_library_that_is_there_is_taken(
    monkeypatch: pytest.MonkeyPatch, there: set[str], expected: str
) -> None:
    monkeypatch.setattr(gl_context, "find_library", lambda name: name if name in there else None)
    monkeypatch.delenv("MUJOCO_GL", raising=False)

    assert gl_context._wanted_backends() == (expected,)


def test_without_pyopengl_the_message_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gl_context, "find_spec", lambda _: None)
    with pytest.raises(CameraUnavailableError, match=r"install farsteer\[camera\]"):
        OffscreenContext(mujoco.MjModel.from_xml_string(MODEL), 32, 32)


@pytest.mark.process
def test_simulations_without_a_camera_load_no_graphics_library() -> None:
    program = (
        "import sys; import robot_sim.simulation, robot_sim.cameras;"
        "assert not [m for m in sys.modules if m.startswith(('OpenGL', 'robot_sim.cameras.look'))];"
        "assert 'robot_sim.cameras.renderer' not in sys.modules;"
        "import robot_sim.cameras.renderer;"
        "assert not [m for m in sys.modules if m.startswith('OpenGL')]"
    )
    subprocess.run(
        [sys.executable, "-c", program],
        check=True,
        timeout=60,
        env={**os.environ, "MUJOCO_GL": "disable"},
    )
