from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from robot_sim import scene_names
from robot_sim.cameras.look.ground_decals import SHADOW
from robot_sim.cameras.look.mesh_groups import FILMS
from robot_sim.cameras.look.render_model import build_render_model
from robot_sim.cameras.look.surface_looks import LOOKS
from robot_sim.cameras.look.world_looks import BARE, OWN
from robot_sim.cameras.renderer import CameraScene, camera_scene
from robot_sim.worlds.loading import load_world
from robot_sim.worlds.world import World, WorldOptions
from tests.robot_sim.driving import state_of

OWN_FILE = """
<mujoco>
  <asset>
    <texture name="check" type="2d" builtin="checker" width="8" height="8" rgb1="1 1 1" rgb2="0 0 1"/>
    <texture name="dusk" type="skybox" builtin="gradient" width="16" height="96" rgb1="1 0 0" rgb2="0 0 1"/>
    <material name="check" texture="check" texrepeat="5 5" specular="0.7"/>
    <material name="brick" rgba="0.6 0.3 0.2 1"/>
    <mesh name="tetrahedron" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/>
    <hfield name="hills" nrow="3" ncol="3" size="6 6 0.5 0.1" elevation="0 0 0  0 1 0  0 0 0"/>
  </asset>
  <worldbody>
    <light pos="0 0 5" dir="0 0 -1" diffuse="0.2 0.3 0.4"/>
    <geom name="ground" type="plane" size="8 8 1" user="0.8"/>
    <geom name="hill" type="hfield" hfield="hills" pos="0 9 0" material="brick"/>
    <geom name="wall" type="box" size="0.1 6 1" pos="5.9 0 1" material="brick"/>
    <geom name="cube" type="box" size="0.5 0.5 0.5" pos="2 2 1" material="check"/>
    <geom name="shape" type="mesh" mesh="tetrahedron" pos="0 -2 1" rgba="0 1 0 1"/>
    <body name="crate" pos="-2.5 0 0.6"><freejoint/><geom type="box" size="0.2 0.2 0.2" mass="2"/></body>
    <site name="spawn" pos="-4 0 1"/>
  </worldbody>
</mujoco>
"""


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> World:
    path: Path = tmp_path_factory.mktemp("own") / "yard.xml"
    path.write_text(OWN_FILE)
    return load_world(str(path))


def drawn(scene: CameraScene) -> mujoco.MjModel:
    built = build_render_model(scene.model, scene.looks, scene.decals, indoors=scene.indoors)
    assert built.model.nmocap == len(built.bodies)
    return built.model


@pytest.mark.slow
@pytest.mark.parametrize("name", scene_names())
def test_every_solid_of_a_scene_is_drawn_with_a_look_of_its_own(name: str) -> None:
    world = load_world(name, options=WorldOptions(alive=True))
    scene = camera_scene(world)
    before = world.model.geom_rgba.tobytes()
    kinds = set(scene.looks)

    assert kinds <= {*LOOKS, BARE}
    assert len(kinds) >= 5
    assert {decal.look for decal in scene.decals} <= {*LOOKS, SHADOW}
    assert len([d for d in scene.decals if d.look != SHADOW]) <= len(world.patches)
    assert scene.indoors == (name in ("corridor", "office", "warehouse"))
    assert world.model.geom_rgba.tobytes() == before


def test_a_corridor_is_drawn_in_few_meshes_under_a_sky_without_costly_effects() -> None:
    scene = camera_scene(load_world("corridor"))
    model = drawn(scene)

    assert model.vis.quality.offsamples == 0
    assert model.vis.quality.shadowsize == 0
    assert not model.light_castshadow.any()
    assert not model.mat_reflectance.any()
    assert (model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX).sum() == 1
    assert model.nmesh < 60
    assert (model.geom_group == FILMS).any()
    floor = load_world("corridor").bounds
    # Everything stands where it stood: the meshes span the floor.
    data = state_of(model)
    reach = (
        data.geom_xpos[:, :2] + np.where(model.geom_bodyid == 0, model.geom_rbound, 0.0)[:, None]
    )
    assert (reach.max(axis=0) >= np.array(floor[2:]) - 0.1).all()


def test_a_file_of_ones_own_keeps_its_materials_lights_and_sky(own: World) -> None:
    scene = camera_scene(own)
    looks = {own.model.geom(i).name: look for i, look in enumerate(scene.looks)}
    assert [looks[n] for n in ("wall", "cube", "shape", "hill")] == [OWN] * 4
    # What the file leaves in MuJoCo's grey gets something to look at.
    assert looks["ground"] == "concrete"
    model = drawn(scene)

    assert model.nlight == 1
    np.testing.assert_allclose(model.light_diffuse[0], (0.2, 0.3, 0.4))
    sky = np.flatnonzero(model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX)
    assert len(sky) == 1
    assert model.tex_width[sky[0]] == 16
    assert 0.7 in model.mat_specular.round(6)
    assert any(np.allclose(rgba, (0.6, 0.3, 0.2, 1.0)) for rgba in model.mat_rgba)
    kinds = model.geom_type.tolist()
    assert kinds.count(mujoco.mjtGeom.mjGEOM_HFIELD) == 1
    assert kinds.count(mujoco.mjtGeom.mjGEOM_BOX) == 2


def test_a_mesh_of_ones_own_stands_where_it_stood(own: World) -> None:
    scene = camera_scene(own)
    model = drawn(scene)
    where = []
    for each, geom in ((own.model, own.model.geom("shape").id), (model, None)):
        data = state_of(each)
        if geom is None:
            # Ours are green in no other geom.
            geom = int(np.flatnonzero((each.geom_rgba == (0.0, 1.0, 0.0, 1.0)).all(axis=1))[0])
        mesh = int(each.geom_dataid[geom])
        start, count = int(each.mesh_vertadr[mesh]), int(each.mesh_vertnum[mesh])
        vertices = each.mesh_vert[start : start + count]
        placed = vertices @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
        where.append(np.array(sorted(placed.round(4).tolist())))

    np.testing.assert_allclose(where[0], where[1], atol=2e-4)
