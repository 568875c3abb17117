"""Settings by name: what is taken, and what is answered to a wrong one."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from localization.config import LocalizerConfig, to_json
from localization.errors import LocalizationError
from localization.maps.prepared_map import PreparedMap
from localization.matching.matchers import Matcher
from localization.motion.sensor_configuration import Motion, SensorConfiguration
from localization.pipeline.localizer import Localizer
from localization.settings import SettingError, assignments, read_settings, with_settings
from tests.support_rooms import MOUNTS


def test_dotted_and_nested_names_set_the_same() -> None:
    dotted = with_settings(LocalizerConfig(), {"registration.normal_noise": 0.15})
    nested = with_settings(LocalizerConfig(), {"registration": {"normal_noise": 0.15}})
    assert dotted == nested
    assert dotted.registration.normal_noise == 0.15
    assert dotted.ekf == LocalizerConfig().ekf


def test_texts_become_the_type_of_their_setting() -> None:
    words = ["registration.normal_noise=1", "kiss_odometry=no", "matcher=none"]
    words += ["ekf.skid_steer=0.2, 0.1 0.02,0.01", "undo_memory=3e9"]
    config = with_settings(LocalizerConfig(), assignments(words))
    assert isinstance(config.registration.normal_noise, float)
    assert config.kiss_odometry is False
    assert config.matcher is Matcher.NONE
    assert config.ekf.skid_steer == (0.2, 0.1, 0.02, 0.01)
    assert config.undo_memory == 3_000_000_000
    assert isinstance(config.undo_memory, int)


@pytest.mark.parametrize("motion", Motion)
@pytest.mark.parametrize("flat", [False, True])
def test_settings_of_a_run_are_read_again_whatever_its_sensors_were(
    tmp_path: Path, motion: Motion, flat: bool
) -> None:
    config = LocalizerConfig.of(SensorConfiguration(motion, flat=flat))
    # Not every program reads numbers that JSON does not have.
    text = json.dumps({"localizer": to_json(config)}, allow_nan=False)
    (tmp_path / "config.json").write_text(text)
    assert with_settings(config, read_settings(tmp_path / "config.json")) == config


def test_the_last_of_two_assignments_counts() -> None:
    words = ["registration.inlier_distance=0.2", "registration.inlier_distance=0.3"]
    assert assignments(words) == {"registration.inlier_distance": "0.3"}


@pytest.mark.parametrize(
    ("word", "why"),
    [
        ("registration.normal_nois=1", "nearest: registration.normal_noise"),
        ("normal_noise=1", "nearest: registration.normal_noise"),
        ("registration=1", "nearest: registration."),
        ("qqqq.zzzz=1", r"docs/settings\.md lists them"),
        ("registration.normal_noise=wide", "must be a finite number, got 'wide'"),
        ("registration.normal_noise=-0.1", "must be a finite number >= 0"),
        ("registration.normal_noise=nan", "must be a finite number, got"),
        ("undo_memory=1.5", "must be a whole number"),
        ("undo_memory=inf", "must be a whole number"),
        ("health.lost_sigma=inf", "must be a finite number, got 'inf'"),
        ("kiss_odometry=maybe", "must be true or false"),
        ("matcher=magic", "must be one of plane"),
        ("ekf.skid_steer=1,2", "must be 4 numbers, got 2"),
        ("belief.sweep=1,2", "must be 3 numbers, got 2"),
        ("normal_noise", "NAME=VALUE"),
        ("=3", "NAME=VALUE"),
    ],
)
def test_wrong_setting_is_one_line_that_names_it(word: str, why: str) -> None:
    with pytest.raises(SettingError, match=why) as error:
        with_settings(LocalizerConfig(), assignments([word]))
    assert "\n" not in str(error.value)


def test_nearest_names_are_those_of_the_same_group() -> None:
    with pytest.raises(SettingError) as error:
        with_settings(LocalizerConfig(), {"registration.normal_noisee": 1})
    assert str(error.value).endswith("nearest: registration.normal_noise")


@pytest.mark.parametrize(
    ("values", "why"),
    [
        ({"ekf.skid_steer": 3}, "ekf.skid_steer must be a list of numbers"),
        ({"registration": {"normal_noise": True}}, "must be a finite number, got True"),
        ({"registration": {"normal_noise": [1]}}, "must be a finite number"),
    ],
)
def test_value_of_another_type_is_named(values: dict[str, object], why: str) -> None:
    with pytest.raises(SettingError, match=why):
        with_settings(LocalizerConfig(), values)


def test_file_holds_tables_and_dotted_names(tmp_path: Path) -> None:
    path = tmp_path / "settings.toml"
    path.write_text(
        'matcher = "none"\nekf.skid_steer = [0.2, 0.1, 0.02, 0.01]\nregistration.normal_noise = 0.15\n'
        "[health]\ncheck_after = 2.5\n"
    )
    config = with_settings(LocalizerConfig(), read_settings(path))
    assert (config.registration.normal_noise, config.health.check_after) == (0.15, 2.5)
    assert config.ekf.skid_steer == (0.2, 0.1, 0.02, 0.01)


def test_config_of_a_run_is_a_file_of_settings(tmp_path: Path) -> None:
    path = tmp_path / "config.json"
    other = with_settings(LocalizerConfig(), {"registration.normal_noise": 0.15})
    path.write_text(json.dumps({"mission": {}, "localizer": to_json(other)}))
    assert with_settings(LocalizerConfig(), read_settings(path)) == other


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("a.toml", "registration = \n", "is not TOML"),
        ("a.json", "{", "is not JSON"),
        ("a.json", "[1]", "must be a table"),
        ("missing.toml", None, "No such file"),
    ],
)
def test_bad_file_of_settings_is_named(
    tmp_path: Path, name: str, text: str | None, why: str
) -> None:
    path = tmp_path / name
    if text is not None:
        path.write_text(text)
    with pytest.raises(SettingError, match=why) as error:
        read_settings(path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("of", "used"),
    [
        (None, SensorConfiguration(Motion.ODOMETRY)),
        (None, SensorConfiguration(flat=True)),
        (SensorConfiguration(Motion.ODOMETRY, flat=True), SensorConfiguration()),
    ],
)
def test_filter_that_is_set_for_other_sensors_is_refused_with_the_way_out(
    hall: PreparedMap, of: SensorConfiguration | None, used: SensorConfiguration
) -> None:
    config = replace(LocalizerConfig() if of is None else LocalizerConfig.of(of), sensors=used)
    with pytest.raises(LocalizationError, match=r"begin with LocalizerConfig\.of\(sensors\)"):
        Localizer(hall, MOUNTS, config)


def test_filter_with_settings_of_its_own_is_taken_for_any_sensors(hall: PreparedMap) -> None:
    for motion in Motion:
        config = LocalizerConfig.of(SensorConfiguration(motion))
        Localizer(hall, MOUNTS, replace(config, ekf=replace(config.ekf, speed_noise=0.02)))
