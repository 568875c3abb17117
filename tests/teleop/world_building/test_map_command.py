"""``farsteer map`` of a scene without ground truth, and of the log of that drive."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from localization.evaluation.tum_file import read_tum
from localization.logs.mcap_writer import ReadingsWriter
from localization.mapping.mesh_distance import distances_to_mesh
from localization.maps.map_files import load_cloud
from localization.types import Pose
from robot_sim import load_world
from robot_sim.survey.static_mesh import static_mesh
from robot_sim.survey.total_station import TotalStation
from teleop.__main__ import main
from teleop.world_building.map_quality import completeness

pytest.importorskip("open3d", reason="building maps needs Open3D")

PLAN = """
bounds = [0.0, 0.0, 5.0, 4.4]
height = 2.5
spawn = [1.3, 1.3, 0.0]
tour = [[1.3, 1.3], [3.7, 1.3]]
survey = [[1.3, 1.3], [3.7, 1.3], [3.7, 3.1], [1.3, 3.1], [1.3, 1.3], [2.6, 1.3]]

[[wall]]
name = "south"
from = [0.0, 0.0]
to = [5.0, 0.0]

[[wall]]
name = "east"
from = [5.0, 0.0]
to = [5.0, 4.4]

[[wall]]
name = "north"
from = [5.0, 4.4]
to = [0.0, 4.4]

[[wall]]
name = "west"
from = [0.0, 4.4]
to = [0.0, 0.0]

[[furniture]]
type = "cabinet"
name = "cabinet"
at = [0.7, 4.05]

[[furniture]]
type = "cabinet"
name = "another"
at = [4.3, 0.35]
"""


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("blind") / "studio.toml"
    path.write_text(PLAN, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def mapped(plan: Path) -> Path:
    out = plan.with_name("map.ply")
    assert main(["map", "--scene", str(plan), "--without-truth", "--out", str(out)]) == 0
    return out


@pytest.mark.slow
def test_map_made_without_truth_lies_on_the_true_surfaces(mapped: Path) -> None:
    quality = json.loads(mapped.with_suffix(".json").read_text(encoding="utf-8"))
    assert quality["way"] == pytest.approx(8.8, abs=0.6)
    assert quality["closures"] >= 2
    assert quality["drive"]["rmse"] < 0.03
    assert quality["drive_moved"]["rmse"] < 0.015
    assert quality["cloud_moved"]["distance"]["rmse"] < 0.012
    assert quality["cloud"]["near"] > 0.99
    # Of walls ahead the vertical scanner, whose plane is transverse, never sees the upper part.
    assert 0.8 < quality["complete"] < 0.9


@pytest.mark.slow
def test_map_without_a_wall_is_not_complete(mapped: Path, plan: Path) -> None:
    world, points = load_world(str(plan)), load_cloud(mapped).points
    whole = completeness(points, world)
    assert completeness(points[points[:, 1] > 0.3], world) < whole - 0.05


@pytest.mark.slow
def test_quality_describes_the_written_files(mapped: Path, plan: Path) -> None:
    quality = json.loads(mapped.with_suffix(".json").read_text(encoding="utf-8"))
    cloud = load_cloud(mapped)
    assert quality["points"] == len(cloud.points)
    distances = distances_to_mesh(cloud.points, *static_mesh(load_world(str(plan))))
    rmse = float(np.sqrt(np.mean(distances**2)))
    assert rmse == pytest.approx(quality["cloud"]["distance"]["rmse"], rel=1e-3)
    truth = read_tum(mapped.with_suffix(".truth.tum"))
    drive = read_tum(mapped.with_suffix(".tum"))
    assert truth.stamps[0] < drive.stamps[0] < drive.stamps[-1] <= truth.stamps[-1]


@pytest.mark.long
@pytest.mark.slow
def test_log_of_the_drive_gives_the_same_map(
    mapped: Path, plan: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """From the same start, the log alone gives the same map."""
    again = plan.with_name("again.ply")
    log = str(mapped.with_suffix(".mcap"))
    assert main(["map", log, "--start", "1.3", "1.3", "0", "--out", str(again)]) == 0
    assert "loops closed" in capsys.readouterr().out
    one, two = read_tum(mapped.with_suffix(".tum")), read_tum(again.with_suffix(".tum"))
    assert np.abs(one.positions - two.positions)[:, :2].max() < 1e-9


def test_mesh_is_where_rays_end(plan: Path) -> None:
    world = load_world(str(plan))
    rng = np.random.default_rng(4)
    directions = rng.standard_normal((500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    eyes = np.tile([2.5, 2.2, 1.6], (500, 1))
    hits = TotalStation(world).look(eyes, directions, 20.0)
    met = np.isfinite(hits.distances)
    assert met.sum() > 300
    ends = eyes[met] + hits.distances[met, None] * directions[met]
    assert distances_to_mesh(ends, *static_mesh(world)).max() < 1e-4
    # A point in the middle of the room is as far from the mesh as from the floor or the walls.
    (middle,) = distances_to_mesh(np.array([[2.5, 2.2, 0.4]]), *static_mesh(world))
    assert middle == pytest.approx(0.4, abs=1e-5)


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["office.mcap", "--scene", "office"], "a log or a scene, not both"),
        (["nowhere.mcap"], "nowhere.mcap: No such file"),
        (["atrium"], "no scene named 'atrium'"),
        (["office", "--start", "1", "2", "3"], "are for logs; a scene has its own"),
        (["office", "--topics", "/scan"], "are for logs; a scene has its own"),
        (["office", "--quick", "--effects"], "--effects and --without-truth need the drive"),
        (["nowhere.mcap", "--quick"], "are for scenes, not for logs"),
    ],
)
def test_invalid_request_is_answered_in_one_line(
    words: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["map", *words]) == 2
    assert complaint in capsys.readouterr().err


@pytest.mark.slow
def test_cloud_of_a_scene_that_cannot_be_written_is_said_before_the_survey(
    plan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The place of the cloud counts: a folder ``runs`` in which nothing is written need not be writable."""
    monkeypatch.chdir(tmp_path)
    Path("runs").touch()
    mine = tmp_path / "mine.toml"
    mine.write_text(plan.read_text(encoding="utf-8"), encoding="utf-8")
    cloud = tmp_path / "mine.ply"
    cloud.mkdir()
    assert main(["map", str(mine), "--quick"]) == 2
    said = capsys.readouterr().err
    assert f"{cloud} is a folder: give a file" in said
    assert "stop 1" not in said
    cloud.rmdir()
    assert main(["map", str(mine), "--quick"]) == 0
    assert load_cloud(cloud).points.size


def test_log_without_scans_is_rejected_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "empty.mcap"
    with ReadingsWriter(log, {"laser_horizontal": Pose.identity()}):
        pass
    assert main(["map", str(log), "--out", str(tmp_path / "map.ply")]) == 2
    assert "no sweeps of a horizontal scanner" in capsys.readouterr().err
    assert not (tmp_path / "map.ply").exists()
