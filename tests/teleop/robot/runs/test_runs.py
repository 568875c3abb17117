"""Runs that clients record on a robot: begun, ended, listed, fetched, and read by other programs."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from localization.logs.frame_tree import SensorLayout
from localization.logs.open_log import open_log
from localization.types import Scan, WheelSpeeds
from teleop.robot.runs.run_book import RunBook
from teleop.robot.runs.run_folder import MOST_BYTES, RunFolder
from teleop.robot.runs.run_recorder import SURFACES, RunRecorder
from teleop.robot.serving.serve_config import ServeConfig
from teleop.ros_types import registry
from teleop.rosbridge import Protocol, Server
from tests.teleop.robot.served_robots import DRIVER, VIEWER, Serving, tokens
from tests.teleop.support import in_a_loop, peer, soon
from tests.teleop.video.support import get

pytestmark = pytest.mark.slow


def _bearer(token: str) -> dict[str, str]:
    return {"authorization": f"Bearer {token}"}


@in_a_loop
async def test_run_holds_what_the_console_shows_and_what_a_localiser_reads(
    serving: Serving, tmp_path: Path
) -> None:
    config = ServeConfig(runs=tmp_path / "runs", tokens=tokens(tmp_path))
    async with serving(config) as robot, peer(f"{robot.url}/?token={DRIVER}") as driver:
        assert (await get(robot.port, "/runs", **_bearer(VIEWER))).json == {"runs": []}
        await driver.subscribe("/runs/state")
        _, answer = await driver.ask("/runs/start")
        assert answer["success"], answer
        name = answer["message"]
        assert not (await driver.ask("/runs/start"))[1]["success"]
        await driver.step(100)
        assert (await get(robot.port, "/runs", **_bearer(VIEWER))).json == {"runs": []}
        assert (await driver.ask("/runs/stop"))[1] == {"success": True, "message": name}
        assert not (await driver.ask("/runs/stop"))[1]["success"]
        states = [json.loads(m["data"])["recording"] for m in driver.messages("/runs/state")]
        assert states == ["", name, ""]
        (run,) = (await get(robot.port, "/runs", **_bearer(VIEWER))).json["runs"]
        assert run["name"] == name
        assert run["seconds"] == pytest.approx(2.0, abs=0.1)
        assert (await get(robot.port, run["url"])).status == 401
        fetched = await get(robot.port, run["url"], **_bearer(VIEWER))
        assert len(fetched.body) == run["bytes"]
        missing = await get(robot.port, "/runs/../tokens.toml", **_bearer(VIEWER))
        assert missing.status == 404
    path = tmp_path / "runs" / name
    with path.open("rb") as file:
        reader = make_reader(file)
        topics = {channel.topic for _, channel, _ in reader.iter_messages()}
        attached = {each.name: each.data[:4] for each in reader.iter_attachments()}
    shown = {"/map_info", "/tf", "/amcl_pose", "/local_cloud", "/localization/status"}
    assert topics >= {*shown, "/teleop/state", "/bumper_state", "/tf_static"}
    assert attached == {SURFACES: b"glTF"}
    inputs = SensorLayout(topics=("/scan", "/scan_vertical", "/joint_states", "/imu/data"))
    readings = list(open_log(path, inputs))
    assert sum(isinstance(r, Scan) for r in readings) >= 18
    assert sum(isinstance(r, WheelSpeeds) for r in readings) >= 95


@in_a_loop
async def test_viewer_may_not_record(serving: Serving, tmp_path: Path) -> None:
    config = ServeConfig(runs=tmp_path / "runs", tokens=tokens(tmp_path))
    async with serving(config) as robot, peer(f"{robot.url}/?token={VIEWER}") as viewer:
        result, words = await viewer.ask("/runs/start")
        assert not result
        assert "role view may not call /runs/start" in str(words)


@in_a_loop
async def test_run_is_kept_and_deleted_by_who_may_drive_and_by_nobody_else(
    serving: Serving, tmp_path: Path
) -> None:
    config = ServeConfig(runs=tmp_path / "runs", tokens=tokens(tmp_path))
    async with (
        serving(config) as robot,
        peer(f"{robot.url}/?token={DRIVER}") as driver,
        peer(f"{robot.url}/?token={VIEWER}") as viewer,
    ):
        _, answer = await driver.ask("/runs/start")
        name = answer["message"]
        assert "is being recorded" in (await driver.ask("/runs/delete", name=name))[1]["message"]
        await driver.step(5)
        await driver.ask("/runs/stop")
        for service, request in (
            ("delete", {"name": name}),
            ("keep", {"name": name, "keep": True}),
        ):
            result, words = await viewer.ask(f"/runs/{service}", **request)
            assert not result
            assert f"role view may not call /runs/{service}" in str(words)
        assert (await driver.ask("/runs/keep", name=name, keep=True))[1]["success"]
        (run,) = (await get(robot.port, "/runs", **_bearer(VIEWER))).json["runs"]
        assert run["kept"]
        assert (await driver.ask("/runs/keep", name=name, keep=False))[1]["success"]
        answer = (await driver.ask("/runs/delete", name="../tokens.toml"))[1]
        assert not answer["success"]
        assert "GET /runs lists them" in answer["message"]
        answer = (await driver.ask("/runs/delete", name=name))[1]
        assert answer == {"success": True, "message": f"{name} is deleted"}
        assert list((tmp_path / "runs").iterdir()) == []


def _stored(folder: Path, *sizes: int) -> list[Path]:
    """Write runs of these sizes [bytes], the oldest first."""
    paths = [folder / f"run-20261124-19300{number}.mcap" for number in range(len(sizes))]
    for path, size in zip(paths, sizes, strict=True):
        with path.open("wb") as file:
            file.truncate(size)
    return paths


def test_oldest_runs_that_nobody_keeps_make_room_and_the_present_one_stays(tmp_path: Path) -> None:
    paths = _stored(tmp_path, 300, 400, 200, 500)
    folder = RunFolder(tmp_path, 1000)
    folder.keep(paths[0], True)
    assert folder.make_room(paths[3]) == [paths[1].name]
    assert folder.make_room(paths[3]) == []
    with paths[3].open("wb") as file:
        file.truncate(900)
    assert folder.make_room(paths[3]) == [paths[2].name]
    assert sorted(p.name for p in tmp_path.glob("*.mcap")) == [paths[0].name, paths[3].name]
    assert RunFolder(tmp_path, 1000).room() == 700


def test_folder_with_the_name_of_a_run_is_not_listed(tmp_path: Path) -> None:
    (tmp_path / "run-20261124-193000.mcap").mkdir()
    folder = RunFolder(tmp_path, MOST_BYTES)
    assert folder.find("run-20261124-193000.mcap") is None
    assert folder.facts("") == []


def test_file_that_was_cut_off_anywhere_is_listed_without_its_length(tmp_path: Path) -> None:
    for path, size in zip(_stored(tmp_path, 0, 0, 0), (0, 3, 50), strict=True):
        path.write_bytes((b"\x89MCAP0\r\n" + bytes(100))[:size])
    facts = RunFolder(tmp_path, 1000).facts("")
    assert [(run["bytes"], run["seconds"]) for run in facts] == [(50, None), (3, None), (0, None)]


@in_a_loop
async def test_robot_says_which_runs_made_room_and_begins_none_where_all_are_kept(
    serving: Serving, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    old, kept = _stored(tmp_path, 30_000_000, 15_000_000)
    async with (
        serving(ServeConfig(runs=tmp_path, runs_space=0.04)) as robot,
        peer(f"{robot.url}/") as driver,
    ):
        await driver.subscribe("/runs/state")
        assert (await driver.ask("/runs/keep", name=kept.name, keep=True))[1]["success"]
        assert (await driver.ask("/runs/start"))[1]["success"]
        async with asyncio.timeout(20.0):
            while old.exists():
                await driver.step(10)
        await driver.ask("/runs/stop")
        removed = [json.loads(m["data"])["removed"] for m in driver.messages("/runs/state")]
        assert [old.name] in removed
        assert kept.exists()
        assert f"removed {old.name}" in caplog.text
        with kept.open("r+b") as file:
            file.truncate(39_000_000)
        refused = (await driver.ask("/runs/start"))[1]
        assert not refused["success"]
        assert "take all of the 0.04 GB" in refused["message"]


@in_a_loop
async def test_full_disk_ends_the_run_and_nothing_else() -> None:
    protocol = Protocol(registry())
    protocol.topics.advertise("/joint_states", "sensor_msgs/msg/JointState")
    ended: asyncio.Queue[str] = asyncio.Queue()
    loop = asyncio.get_running_loop()

    def end(why: str) -> None:
        loop.call_soon_threadsafe(ended.put_nowait, why)

    recorder = RunRecorder(protocol, Path("/dev/full"), lambda: 0, None, end, most=MOST_BYTES)
    for _ in range(3000):
        protocol.topics.publish("/joint_states", {"name": ["wheel"] * 20}, 0)
    assert "No space left on device" in await soon(ended.get())
    recorder.close()
    protocol.topics.publish("/joint_states", {}, 0)


@in_a_loop
async def test_folder_that_cannot_be_made_is_said_by_name(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    server = Server(Protocol(registry()), "127.0.0.1")
    date = "2026-11-24T19:30:00"
    book = RunBook(
        server,
        tmp_path / "file" / "runs",
        space=MOST_BYTES,
        stamp=lambda: 0,
        date=lambda: date,
        audit=None,
    )
    async with server, peer(server.url) as client:
        answer: Any = (await client.ask("/runs/start"))[1]
    book.close()
    assert not answer["success"]
    assert str(tmp_path / "file" / "runs") in answer["message"]
