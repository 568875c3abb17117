"""What a camera sees: where, how far, and the same again."""

from __future__ import annotations

import hashlib
import math
import os
import pickle
import subprocess
import sys
from ctypes.util import find_library
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from localization.types import Pose, Twist
from robot_sim import AddedBox, Simulation, World, WorldOptions
from robot_sim.cameras import CAMERAS, CameraModel, VisualState
from robot_sim.cameras.look.world_looks import BARE, OWN
from robot_sim.cameras.renderer import CameraRenderer, CameraScene, camera_scene
from robot_sim.robot.platforms import PLATFORMS
from robot_sim.scene_objects.plan_elements import Placement
from robot_sim.worlds.loading import load_world, parse_world
from tests.robot_sim.cameras.conftest import Make
from tests.robot_sim.conftest import ROOM
from tests.robot_sim.driving import run, state_of

EYE = (0.1, 0.0, 0.5)
BENCH = """
<mujoco><asset><material name="glass" rgba="0.7 0.8 0.9 0.3"/></asset><worldbody>
<geom name="box" type="box" pos="3 0.4 0.5" size="0.25 0.3 0.2" euler="10 20 30" rgba="1 0 0 1"/>
<geom name="back" type="box" pos="6 0 0" size="0.1 6 6" rgba="0 0 1 1"/>
<geom name="pane" type="box" pos="2 -1 0.5" size="0.01 0.5 0.5" material="glass"/>
<body name="base_link"><freejoint/><geom size="0.01" rgba="0 0 0 0"/></body>
</worldbody></mujoco>
"""
FINE = CameraModel("fine", near=0.1, far=20.0)


def still(model: mujoco.MjModel) -> VisualState:
    return VisualState(5, model.qpos0.copy(), np.zeros((0, 3)), np.zeros((0, 4)))


def at(simulation: Simulation, x: float, y: float, yaw: float) -> VisualState:
    """Return the present state with the robot elsewhere."""
    state = simulation.visual_state()
    address = int(simulation.world.model.joint("base_link").qposadr[0])
    pose = Pose.from_euler((x, y, 0.0), yaw=yaw)
    state.qpos[address : address + 7] = (*pose.position, *pose.quaternion_wxyz)
    return state


def digest(renderer: CameraRenderer, state: VisualState) -> str:
    frame = renderer.render(state)
    return hashlib.sha256(frame.rgb.tobytes() + frame.depth.tobytes()).hexdigest()


@pytest.mark.parametrize("looks", [(OWN,) * 4, (BARE, BARE, "glass", BARE)], ids=["own", "ours"])
def test_pixels_and_depths_are_where_the_camera_matrix_has_them(
    make_renderer: Make, looks: tuple[str, ...]
) -> None:
    model = mujoco.MjModel.from_xml_string(BENCH)
    data = state_of(model)
    scene = CameraScene(model, Pose.from_euler(EYE), looks, (), indoors=True)
    frame = make_renderer(scene, FINE).render(still(model))
    (fx, fy), (cx, cy) = FINE.focal_lengths, FINE.principal_point

    signs = np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
    box = model.geom("box")
    corners = signs * box.size @ data.geom("box").xmat.reshape(3, 3).T + data.geom("box").xpos - EYE
    u, v = cx - fx * corners[:, 1] / corners[:, 0], cy - fy * corners[:, 2] / corners[:, 0]
    red = frame.rgb[..., 0].astype(float) > 1.5 * frame.rgb[..., 2]
    near = (frame.depth < 4.5) & (np.arange(640) < 400)
    for seen in (red, near):
        rows, columns = np.nonzero(seen)
        assert columns.min() == pytest.approx(u.min(), abs=1.0)
        assert columns.max() == pytest.approx(u.max(), abs=1.0)
        assert rows.min() == pytest.approx(v.min(), abs=1.0)
        assert rows.max() == pytest.approx(v.max(), abs=1.0)
    # Planar depth: the same over a whole wall across the optical axis. The sensor looks through glass.
    np.testing.assert_allclose(frame.depth[~near & ~red], 5.8, atol=1e-4)
    nearest = corners[:, 0].min()
    assert np.nanmin(frame.depth) == pytest.approx(nearest, abs=0.01)
    assert frame.stamp == 5
    # The pane takes something from the blue wall behind it.
    assert not np.array_equal(frame.rgb[240, 600], frame.rgb[470, 20])


def test_a_camera_that_looks_down_and_aside_sees_what_is_there(make_renderer: Make) -> None:
    scene = CameraScene(
        mujoco.MjModel.from_xml_string(BENCH), Pose.from_euler(EYE), (OWN,) * 4, (), indoors=True
    )
    # The box's middle is 2.9 m ahead and 0.4 m to the left of the eye, at its height.
    left = CameraModel("left", near=0.1, far=20.0, aside=0.2, down=0.2, turned=math.atan2(0.2, 2.9))
    frame = make_renderer(scene, left).render(still(scene.model))
    fy = left.focal_lengths[1]
    red = np.nonzero(frame.rgb[..., 0].astype(float) > 1.5 * frame.rgb[..., 2])

    assert np.mean(red[1]) == pytest.approx(left.principal_point[0], abs=12.0)
    assert np.mean(red[0]) == pytest.approx(left.principal_point[1] - fy * math.tan(0.2), abs=12.0)


@pytest.fixture(scope="module")
def office() -> World:
    return load_world("office", options=WorldOptions(alive=True))


@pytest.fixture(scope="module")
def drive(office: World) -> Simulation:
    simulation = Simulation(office)
    run(simulation, 5)
    return simulation


def test_the_same_state_gives_the_same_bytes(
    make_renderer: Make, office: World, drive: Simulation
) -> None:
    renderer, state = make_renderer(office), drive.visual_state()
    first = digest(renderer, state)
    elsewhere = digest(renderer, at(drive, 6.0, 4.0, 2.0))

    assert elsewhere != first
    assert digest(renderer, pickle.loads(pickle.dumps(state))) == first


def test_cameras_beside_each_other_do_not_disturb_each_other(
    make_renderer: Make, office: World, drive: Simulation
) -> None:
    renderer, state = make_renderer(office), drive.visual_state()
    first = digest(renderer, state)
    other = CameraRenderer(parse_world(ROOM, name="room"), replace(renderer.model, width=64))
    assert digest(renderer, state) == first
    del other
    assert digest(renderer, state) == first


OTHER_PROCESS = """
import pickle, sys
from robot_sim.cameras import CAMERAS
from robot_sim.cameras.renderer import CameraRenderer
scene, state = pickle.load(sys.stdin.buffer)
frame = CameraRenderer(scene, CAMERAS["small"]).render(state)
pickle.dump((frame.rgb, frame.depth, "OpenGL.osmesa" in sys.modules), sys.stdout.buffer)
"""


def drawn_elsewhere(
    world: World, state: VisualState, backend: str
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Return colours and depths that another process draws, and whether it does so by OSMesa."""
    done = subprocess.run(
        [sys.executable, "-c", OTHER_PROCESS],
        input=pickle.dumps((camera_scene(world), state)),
        capture_output=True,
        check=True,
        timeout=120,
        env={**os.environ, "MUJOCO_GL": backend},
    )
    rgb, depth, osmesa = pickle.loads(done.stdout)
    return rgb, depth, osmesa


@pytest.mark.process
def test_another_process_draws_the_same_bytes(
    make_renderer: Make, office: World, drive: Simulation
) -> None:
    state = drive.visual_state()
    expected = make_renderer(office).render(state)
    rgb, depth, _ = drawn_elsewhere(office, state, "disable")
    assert rgb.tobytes() == expected.rgb.tobytes()
    assert depth.tobytes() == expected.depth.tobytes()


@pytest.mark.process
def test_osmesa_draws_what_egl_draws(make_renderer: Make, office: World) -> None:
    if find_library("OSMesa") is None:
        pytest.skip("OSMesa is missing; on Debian 12: sudo apt-get install libosmesa6")
    state = at(Simulation(office), 1.0, 0.5, 0.4)
    expected = make_renderer(office).render(state)
    rgb, depth, by_osmesa = drawn_elsewhere(office, state, "osmesa")
    assert by_osmesa
    # The same renderer gives the same bits; EGL may also be a graphics card's.
    assert np.abs(rgb.astype(int) - expected.rgb).mean() < 2.0
    near = np.isclose(depth, expected.depth, atol=0.02, equal_nan=True)
    assert near.mean() > 0.99
    assert np.isfinite(depth).mean() > 0.5


def test_the_physics_is_the_same_with_and_without_a_camera(make_renderer: Make) -> None:
    def trajectory(*, camera: bool) -> str:
        world = parse_world(ROOM, name="room")
        simulation, sha = Simulation(world, seed=3), hashlib.sha256()
        renderer = make_renderer(world) if camera else None
        for _ in range(40):
            simulation.command(Twist.planar(0.5, 0.4))
            simulation.step()
            if renderer is not None:
                renderer.render(simulation.visual_state())
            sha.update(simulation.visual_state().qpos.tobytes())
        return sha.hexdigest()

    assert trajectory(camera=True) == trajectory(camera=False)


def test_what_comes_at_its_time_is_seen(make_renderer: Make) -> None:
    box = AddedBox((0.6, 0.6, 0.6), Placement(6.0, 3.0), start_ns=1_000_000_000)
    options = WorldOptions(extras=(box,), spare_people=1)
    world = parse_world(ROOM, name="room", options=options)
    simulation, renderer = Simulation(world), make_renderer(world)

    def ahead() -> float:
        frame = renderer.render(simulation.visual_state())
        return float(np.nanmin(frame.depth[100:140, 140:180]))

    before = ahead()
    while simulation.stamp < 1_000_000_000:
        simulation.step()
    with_box = ahead()
    simulation.spares.put("spare_person_1", Placement(5.2, 3.0))
    with_person = ahead()

    camera = world.robot.camera_mount.position
    assert before == pytest.approx(6.0 - camera[0], abs=0.02)
    assert with_box == pytest.approx(5.7 - 4.0 - camera[0], abs=0.02)
    assert with_person < with_box - 0.3


@pytest.mark.parametrize("platform", PLATFORMS)
def test_the_robot_does_not_see_itself(make_renderer: Make, platform: str) -> None:
    world = parse_world(ROOM, name="room", robot=PLATFORMS[platform])
    wide = CameraModel("close", 160, 120, math.radians(90.0), math.radians(90.0), near=0.05)
    state, scene = Simulation(world).visual_state(), camera_scene(world)
    behind = Pose.from_euler(scene.base_from_camera.position - (0.4, 0.0, 0.0))

    # With the floor half a metre below, half a metre is the nearest that it may see.
    assert np.nanmin(make_renderer(scene, wide).render(state).depth) > 0.45
    backward = make_renderer(replace(scene, base_from_camera=behind), wide)
    assert np.nanmin(backward.render(state).depth) < 0.4


def test_a_state_is_small_and_stays_as_it_was_taken(drive: Simulation) -> None:
    state = drive.visual_state()
    assert len(pickle.dumps(state)) < 10_000
    assert state.stamp == drive.stamp
    drive.step()
    assert not np.array_equal(drive.visual_state().mocap_pos, state.mocap_pos)


def test_nothing_is_measured_out_of_range(make_renderer: Make) -> None:
    world = parse_world(ROOM, name="room")
    near = CameraModel("near", width=64, height=48, near=0.5, far=2.0)
    frame = make_renderer(world, near).render(Simulation(world).visual_state())

    assert np.isnan(frame.depth[24, 32])
    assert frame.depth_mm[24, 32] == 0
    assert np.isfinite(frame.depth).any()
    assert np.nanmax(frame.depth) <= 2.0


def test_a_renderer_that_nobody_closed_leaves_the_next_one_alone() -> None:
    world = parse_world(ROOM, name="room")
    state, model = Simulation(world).visual_state(), CAMERAS["small"]
    abandoned = CameraRenderer(world, model)
    expected = digest(abandoned, state)
    with CameraRenderer(world, model) as other:
        del abandoned
        assert digest(other, state) == expected
