"""``farsteer world``: the folders it writes load again, and bad requests are answered in a line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from localization.maps.cloud import CloudError
from localization.maps.map_files import load_cloud
from robot_sim import load_world
from teleop.__main__ import main
from teleop.scene_clouds import load_scene_cloud, scene_cloud_path


def refused(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert main(words) == 2
    text = capsys.readouterr().err
    assert "Traceback" not in text
    (line,) = [part for part in text.splitlines() if part.startswith("farsteer: ")]
    return line


def write_map(folder: Path, middle: bytes = b"\xfe" * 80) -> Path:
    """Write a room of 4 by 3 m as an occupancy map; ``middle`` are the pixels of its rows."""
    rows = [b"\x00" * 84] * 2 + [b"\x00\x00" + middle + b"\x00\x00"] * 60 + [b"\x00" * 84] * 2
    (folder / "room.pgm").write_bytes(b"P5\n84 64\n255\n" + b"".join(rows))
    path = folder / "room.yaml"
    path.write_text(
        "image: room.pgm\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return path


@pytest.mark.slow
def test_generated_building_is_a_scene_that_loads_and_asks_for_its_cloud(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["world", "generate", "--seed", "4", "--area", "60", "--no-cloud"]) == 0
    assert "farsteer map worlds/building-4 --quick" in capsys.readouterr().out
    folder = tmp_path / "worlds" / "building-4"
    assert {p.name for p in folder.iterdir()} == {"world.toml", "picture.png", "README.md"}
    world = load_world("worlds/building-4")
    assert world.name == "building-4"
    assert len(world.tour) > 4
    assert f"{world.area:.0f} m²" in (folder / "README.md").read_text(encoding="utf-8")
    assert main(["world", "list"]) == 0
    listed = capsys.readouterr().out
    assert "worlds/building-4" in listed
    assert "office" in listed
    assert main(["world", "show", "worlds/building-4"]) == 0
    shown = capsys.readouterr().out
    assert "drivable  floor" in shown
    assert "corridor_1" in shown
    with pytest.raises(CloudError, match="run `farsteer map worlds/building-4`"):
        load_scene_cloud("worlds/building-4")
    assert "farsteer map worlds/building-4" in refused(
        ["sim", "--scene", "worlds/building-4"], capsys
    )


@pytest.mark.slow
def test_extruded_map_is_a_scene_that_loads_with_its_cloud(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["world", "from-map", str(write_map(tmp_path)), "--spawn", "1.5", "1.0", "90"]
    assert main(words) == 0
    assert "farsteer serve --scene worlds/room" in capsys.readouterr().out
    world = load_world("worlds/room")
    assert world.spawn.position[:2] == pytest.approx([1.5, 1.0])
    assert world.bounds == pytest.approx((0.0, 0.0, 4.2, 3.2))
    assert scene_cloud_path("worlds/room") == Path("worlds/room/cloud.ply")
    assert load_scene_cloud("worlds/room").sha256 == load_cloud("worlds/room/cloud.ply").sha256


def test_summary_says_what_the_survey_misses_and_which_cells_are_near_a_threshold(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A wall divides the room, and a band of furniture is as grey as free floor may just be."""
    monkeypatch.chdir(tmp_path)
    path = write_map(tmp_path, b"\xfe" * 40 + b"\x00" * 2 + b"\xd3" * 8 + b"\xfe" * 30)
    assert main(["world", "from-map", str(path), "--no-cloud"]) == 0
    said = capsys.readouterr().out
    assert "reach     the survey comes near 51 % of the free floor, 12 m2" in said
    assert "not near 6 m2 round (3.1, 1.0): there is no opening" in said
    assert "480 free cells are within 0.06 of free_thresh, most of them grey 211" in said


def test_page_of_an_extruded_map_has_the_command_that_makes_it_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """With its height and its spawn; a folder with a blank is quoted where the shell would split it."""
    monkeypatch.chdir(tmp_path)
    words = ["world", "from-map", write_map(tmp_path).name, "--height", "3.1", "--no-cloud"]
    words += ["--spawn", "1.5", "1.0", "-90"]
    assert main([*words, "--out", "my room"]) == 0
    assert "farsteer serve --scene 'my room'" in capsys.readouterr().out
    page = Path("my room/README.md").read_text(encoding="utf-8")
    assert "`farsteer world from-map room.yaml --height 3.1 --spawn 1.5 1 -90`" in page
    assert "`farsteer map 'my room' --quick`" in page
    assert "farsteer sim --scene 'my room'\n" in page


def test_list_says_which_worlds_cannot_be_read_and_has_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    good = "bounds = [0, 0, 10, 8]\nspawn = [2, 2, 0]\n"
    for name, text in (("a", b"bounds = ["), ("b", b"# ol\xe9\n"), ("c", good.encode())):
        (tmp_path / "worlds" / name).mkdir(parents=True)
        (tmp_path / "worlds" / name / "world.toml").write_bytes(text)
    assert main(["world", "list"]) == 0
    listed = capsys.readouterr().out
    assert "worlds/a                world 'a' is not valid TOML" in listed
    assert "worlds/b                cannot read the floor plan" in listed
    assert "worlds/c                    80 m2" in listed
    assert main(["world", "list", "--json"]) == 0
    rows = {row["scene"]: row for row in json.loads(capsys.readouterr().out)}
    assert "not valid TOML" in rows["worlds/a"]["error"]
    assert rows["worlds/c"]["area"] == 80.0


def test_each_place_of_a_world_has_a_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    places = "".join(f"office_{i} = [{i}, 2, 0]\n" for i in range(1, 9))
    plan = tmp_path / "plan.toml"
    plan.write_text(f"bounds = [0, 0, 10, 8]\nspawn = [2, 2, 0]\n[places]\n{places}")
    assert main(["world", "show", str(plan)]) == 0
    shown = capsys.readouterr().out.splitlines()
    assert "places    office_1 (1.0, 2.0, 0 deg)" in shown
    assert "          office_8 (8.0, 2.0, 0 deg)" in shown


def test_mistakes_in_a_map_are_refused_in_a_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_map(tmp_path)
    typed = path.with_name("typed.yaml")
    typed.write_text(path.read_text().replace("0.05", "5"))
    assert "is no building" in refused(["world", "from-map", str(typed)], capsys)


def test_impossible_buildings_are_refused_with_what_would_do(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ["world", "generate", "--area"]
    assert "area must be 60 to 10000 m^2, got 5" in refused([*words, "5"], capsys)
    assert "area must be 60 to 10000 m^2, got nan" in refused([*words, "nan"], capsys)
    assert "seed must be" in refused(["world", "generate", "--seed", "-1"], capsys)


def test_unreadable_map_is_refused_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = str(tmp_path / "none.yaml")
    line = refused(["world", "from-map", missing], capsys)
    assert missing in line
    assert "No such file" in line
    path = write_map(tmp_path)
    path.write_text(path.read_text().replace("resolution: 0.05\n", ""))
    assert "lacks the entry 'resolution'" in refused(["world", "from-map", str(path)], capsys)


def test_folder_that_is_no_scene_and_unknown_scene_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "has no world.toml" in refused(["world", "show", str(tmp_path)], capsys)
    assert "office" in refused(["world", "show", "atlantis"], capsys)
