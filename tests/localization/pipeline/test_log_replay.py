from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from localization.config import from_json, to_json
from localization.filter.ekf import EkfConfig
from localization.logs.log_interface import LogError
from localization.logs.mcap_log import read_log
from localization.maps.cloud import CloudError
from localization.maps.map_files import load_cloud
from localization.maps.prepared_map import prepare
from localization.matching.matchers import Matcher
from localization.matching.registration import RegistrationConfig
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.pipeline.log_replay import (
    CONFIG_KEY,
    config_of,
    localize,
)
from localization.types import Estimate, Hint, Inertial, Pose, Reading, Verdict
from tests.support import bits
from tests.support_rooms import HALL, MOUNTS, TICK, Drive, write_log

START = Pose.planar(3.0, 2.0, 0.3)
OTHER = dataclasses.replace(
    LocalizerConfig(),
    ekf=EkfConfig(gyro_noise=0.001),
    undo_memory=30_000_000_000,
    min_inlier_ratio=0.25,
)


@pytest.fixture(scope="module")
def drive() -> list[Reading]:
    readings = Drive(HALL, START, (0.5, 0.0, 0.0), (1.5, 0.5, 0.3)).readings()
    readings.insert(15, Hint(5 * TICK, START @ Pose.planar(0.3, 0.2, 0.1), np.zeros((6, 6))))
    return readings


def essence(e: Estimate) -> object:
    return (
        e.stamp,
        bits(e.map_from_base),
        bits(e.odom_from_base),
        bits(e.covariance),
        bits(e.twist.linear),
        bits(e.twist.angular),
        e.health,
        e.reasons,
        e.nis,
        None if e.match is None else bits(e.match.distances),
        None if e.verdict is None else (e.verdict.verdict, e.verdict.reason),
    )


def live(drive: list[Reading], hall_map: Path, config: LocalizerConfig) -> list[object]:
    localizer = Localizer(prepare(load_cloud(hall_map)), MOUNTS, config)
    return [essence(e) for r in drive if isinstance((e := localizer.add(r), r)[1], Inertial)]


@pytest.mark.slow
@pytest.mark.parametrize("config", [LocalizerConfig(), OTHER], ids=["default", "other"])
def test_log_replays_to_the_same_bits(
    drive: list[Reading], hall_map: Path, tmp_path: Path, config: LocalizerConfig
) -> None:
    log = write_log(tmp_path / "log.mcap", drive, **{CONFIG_KEY: json.dumps(to_json(config))})
    result = localize(log, hall_map)
    assert [essence(e) for e in result.estimates] == live(drive, hall_map, config)
    assert result.estimates[-1].map_from_base is not None
    assert [v.verdict for v in result.verdicts] == [Verdict.ACCEPTED]
    assert result.notes == ()


@pytest.mark.slow
def test_other_settings_give_other_bits(drive: list[Reading], hall_map: Path) -> None:
    """Or the test before would pass whatever a log says of its settings."""
    assert live(drive, hall_map, OTHER) != live(drive, hall_map, LocalizerConfig())


def test_map_other_than_the_recorded_one_is_noted(
    drive: list[Reading], hall_map: Path, tmp_path: Path
) -> None:
    log = write_log(tmp_path / "log.mcap", drive[:30], map_sha256="f" * 64)
    (note,) = localize(log, hall_map, cache=tmp_path / "cache").notes
    assert "recorded with another map (ffffffffffff, not" in note
    assert list((tmp_path / "cache").iterdir())


def test_missing_log_or_map_is_named(hall_map: Path, tmp_path: Path, drive: list[Reading]) -> None:
    with pytest.raises(LogError, match=r"nolog\.mcap"):
        localize(tmp_path / "nolog.mcap", hall_map)
    log = write_log(tmp_path / "log.mcap", drive[:5])
    with pytest.raises(CloudError, match=r"nomap\.ply"):
        localize(log, tmp_path / "nomap.ply")


# Configuration


@pytest.mark.parametrize(
    "config", [LocalizerConfig(), OTHER, dataclasses.replace(OTHER, matcher=Matcher.KISS)]
)
def test_configuration_survives_json(config: LocalizerConfig) -> None:
    again = from_json(LocalizerConfig, json.loads(json.dumps(to_json(config))))
    assert again == config
    assert again.matcher is config.matcher


def test_settings_left_out_keep_their_defaults() -> None:
    config = from_json(LocalizerConfig, {"registration": {"sigma": 0.05}})
    assert config == LocalizerConfig(registration=RegistrationConfig(sigma=0.05))


@pytest.mark.parametrize(
    ("values", "why"),
    [
        ({"wizard": "magic"}, "unknown setting 'wizard' of LocalizerConfig"),
        ({"matcher": "magic"}, "matcher must be one of 'plane', 'kiss', 'none', got 'magic'"),
        ({"ekf": {"gyro_nose": 1.0}}, "unknown setting 'gyro_nose' of EkfConfig"),
    ],
)
def test_unknown_setting_is_refused_by_name(values: dict[str, object], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        from_json(LocalizerConfig, values)


@pytest.mark.parametrize("text", ['{"matcher": 1}', "not json", '{"ekf": 3}', "[1]"])
def test_log_with_foreign_settings_is_refused_by_name(
    tmp_path: Path, drive: list[Reading], text: str
) -> None:
    log = read_log(write_log(tmp_path / "log.mcap", drive[:3], **{CONFIG_KEY: text}))
    with pytest.raises(LogError, match=r"log\.mcap: its localiser configuration is not ours"):
        config_of(log)


def test_settings_of_another_version_are_left_out_and_reported(
    tmp_path: Path, drive: list[Reading], hall_map: Path
) -> None:
    text = '{"wizard": 3, "ekf": {"gyro_nose": 1.0, "slip_forward": 0.25}}'
    path = write_log(tmp_path / "log.mcap", drive[:3], **{CONFIG_KEY: text})
    assert config_of(read_log(path)) == LocalizerConfig(ekf=EkfConfig(slip_forward=0.25))
    notes = localize(path, hall_map).notes
    assert "recorded by another version; settings left out: wizard, ekf.gyro_nose" in notes


def test_log_without_settings_gets_the_default(tmp_path: Path, drive: list[Reading]) -> None:
    assert config_of(read_log(write_log(tmp_path / "log.mcap", drive[:3]))) == LocalizerConfig()


def test_start_stands_in_for_the_hints_of_the_log(
    tmp_path: Path, hall_map: Path, drive: list[Reading]
) -> None:
    """The log's own may be of another map: here it is wrong by a room, and comes at the very first."""
    away = Hint(TICK, START @ Pose.planar(40.0, 0.0, 1.0), np.zeros((6, 6)))
    log = write_log(tmp_path / "log.mcap", [away, *drive])
    done = localize(log, hall_map, start=START @ Pose.planar(0.2, -0.1, 0.05), cache=None)
    assert [v.verdict for v in done.verdicts] == [Verdict.ACCEPTED]
    assert done.estimates[-1].map_from_base is not None
