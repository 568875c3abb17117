from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from localization.calibration.calibration_summary import summary
from localization.calibration.extrinsic_calibration import (
    Calibration,
    InsufficientDriveError,
    corrected,
    estimate_mounts,
)
from localization.calibration.mount_file import read_mounts
from localization.calibration.sample_extraction import calibration_samples
from localization.evaluation.consistency import nees
from localization.geometry import FloatArray, so3_log
from localization.maps.prepared_map import PreparedMap, prepare
from localization.monitoring.extrinsics_monitor import ExtrinsicsMonitorConfig
from localization.mount_estimation.calibration_config import AXES
from localization.mount_estimation.calibration_sample import CalibrationSample
from localization.pipeline.localizer import Localizer, LocalizerConfig
from localization.types import Hint, Mounts, Pose, Reading
from teleop.__main__ import main
from tests.support_rooms import HALL, MOUNTS, Drive, write_log

pytestmark = pytest.mark.slow

START = Pose.planar(2.6, 1.6, 0.2)
LOOP = ((0.6, 0.0, 0.0), (4.0, 0.5, 0.35), (2.5, 0.0, 0.9), (3.5, 0.4, -0.35), (2.0, 0.0, -0.9))
WRONG = corrected(
    corrected(MOUNTS, "laser_horizontal", np.array([0.0, 0.02, 0.0, *np.deg2rad([0.0, 0.0, 1.5])])),
    "laser_vertical",
    np.array([0.0, -0.02, 0.02, *np.deg2rad([1.0, 0.0, 0.0])]),
)
"""One scanner 1.5 degrees off in yaw and 2 cm in y; the other 1 degree in roll, 2 cm in -y and in z."""


def readings_of(drive: Drive) -> list[Reading]:
    readings = drive.readings()
    return [*readings[:20], Hint(readings[19].stamp, START, np.zeros((6, 6))), *readings[20:]]


def samples(world: PreparedMap, readings: list[Reading], mounts: Mounts) -> list[CalibrationSample]:
    return list(calibration_samples(readings, world, mounts, LocalizerConfig()))


def left(found: Calibration, name: str) -> FloatArray:
    """Remaining error of a mount (6,), along the axes of its sigma."""
    return left_of(found.base_from_scanner, name)


@pytest.fixture(scope="module")
def readings() -> list[Reading]:
    return readings_of(Drive(HALL, START, *LOOP, noise=0.012, seed=4))


@pytest.fixture(scope="module")
def found(hall: PreparedMap, readings: list[Reading]) -> Calibration:
    return estimate_mounts(samples(hall, readings, WRONG), hall, WRONG)


@pytest.mark.parametrize("name", sorted(MOUNTS))
def test_wrong_mounts_are_found_within_their_sigma(found: Calibration, name: str) -> None:
    (mount,) = (m for m in found.mounts if m.scanner == name)
    assert (np.abs(left(found, name)) < 3.0 * mount.sigma).all()
    observable = [axis for axis, known in zip(AXES, mount.observable, strict=True) if known]
    # Level beams among upright walls leave their own height unobservable.
    expected = {"laser_horizontal": ["yaw"], "laser_vertical": ["z", "roll", "pitch", "yaw"]}
    assert observable == expected[name]


def test_relative_mounts_are_found_to_millimetres(found: Calibration) -> None:
    _, vertical = found.mounts
    apart, sigma = found.relative_to_first(vertical)
    wanted = left_of(WRONG, "laser_vertical") - left_of(WRONG, "laser_horizontal")
    assert (np.abs(apart - wanted) < 3.0 * sigma).all()
    assert (sigma[:2] < 0.006).all()


def left_of(mounts: Mounts, name: str) -> FloatArray:
    turn = so3_log(MOUNTS[name].rotation @ mounts[name].rotation.T)
    return np.concatenate([MOUNTS[name].position - mounts[name].position, turn])


def test_summary_names_axes_that_are_off_and_unobservable_ones(found: Calibration) -> None:
    lines = "\n".join(summary(found))
    assert "laser_horizontal differs from its given mount: yaw -1." in lines
    assert re.search(r"laser_vertical: x.* not observable from this drive", lines)


def errors(world: PreparedMap, readings: list[Reading], mounts: Mounts, drive: Drive) -> FloatArray:
    """NEES at each sweep from two seconds on, and the horizontal error [m]: (N, 2)."""
    localizer, rows = Localizer(world, mounts), []
    for reading in readings:
        e = localizer.add(reading)
        if e.match is None or e.stamp < 2_000_000_000 or e.map_from_base is None:
            continue
        true = drive.pose(e.stamp)
        off = true.position - e.map_from_base.position
        turn = so3_log(e.map_from_base.rotation.T @ true.rotation)
        (square,) = nees(np.concatenate([off, turn])[None], e.covariance[None])
        rows.append((square, np.hypot(off[0], off[1])))
    return np.array(rows)


def test_calibrated_mounts_restore_accuracy_and_consistency(
    hall: PreparedMap, found: Calibration
) -> None:
    drive = Drive(HALL, START, *LOOP[:3], noise=0.012, seed=5)
    readings = readings_of(drive)
    wrong, after = (
        errors(hall, readings, m, drive).mean(axis=0) for m in (WRONG, found.base_from_scanner)
    )
    assert wrong[0] > 50.0
    assert after[0] < 8.0
    assert wrong[1] > 0.015
    assert after[1] < 0.006


def test_correct_mounts_stay_as_they_are(hall: PreparedMap, readings: list[Reading]) -> None:
    found = estimate_mounts(samples(hall, readings, MOUNTS), hall, MOUNTS)
    for mount in found.mounts:
        assert not mount.off
        assert (np.abs(mount.correction) < 3.0 * mount.sigma).all()
        assert np.abs(mount.correction[:3]).max() < 0.006
        assert np.abs(mount.correction[3:]).max() < np.deg2rad(0.3)
    assert summary(found)[-1].startswith("all scanners agree with their given mounts")


def test_scattered_normals_of_a_map_do_not_make_the_height_of_a_level_scanner_observable(
    hall: PreparedMap, readings: list[Reading]
) -> None:
    cloud = hall.cloud
    scattered = cloud.normals + np.random.default_rng(1).normal(0.0, 0.04, cloud.normals.shape)
    scattered /= np.linalg.norm(scattered, axis=1, keepdims=True)
    world = prepare(replace(cloud, normals=scattered))
    level, upright = estimate_mounts(samples(world, readings, MOUNTS), world, MOUNTS).mounts
    assert level.observable[AXES.index("z")] is False
    assert level.after.position[2] == level.before.position[2]
    assert upright.observable[AXES.index("z")] is True


def test_rolling_wheels_make_the_yaw_of_a_single_scanner_observable(
    hall: PreparedMap, readings: list[Reading]
) -> None:
    alone = {"laser_horizontal": WRONG["laser_horizontal"]}
    found = estimate_mounts(samples(hall, readings, alone), hall, alone)
    (mount,) = found.mounts
    assert mount.off == ("yaw",)
    assert np.abs(left(found, "laser_horizontal")[5]) < 3.0 * mount.sigma[5] < np.deg2rad(1.5)


def test_standing_robot_gives_too_few_samples(hall: PreparedMap, readings: list[Reading]) -> None:
    standing = [r for r in readings if r.stamp < 1_500_000_000]
    with pytest.raises(InsufficientDriveError, match="sweeps that the map explains"):
        estimate_mounts(samples(hall, standing, MOUNTS), hall, MOUNTS)


def test_log_is_calibrated_and_localised_with_the_result(
    hall_map: Path,
    readings: list[Reading],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "mounts.toml"
    log = write_log(tmp_path / "log.mcap", readings, WRONG, map="hall")
    assert main(["calibrate", str(log), "--map", str(hall_map)]) == 0
    assert "laser_horizontal differs from its given mount" in capsys.readouterr().out
    yaw = read_mounts(out)["laser_horizontal"].yaw
    assert yaw == pytest.approx(0.0, abs=np.deg2rad(0.4))
    arguments = [
        "localize",
        str(log),
        "--map",
        str(hall_map),
        "--mounts",
        str(out),
        "--no-recording",
    ]
    assert main([*arguments, "--no-report", "--out", str(tmp_path / "run")]) == 0
    assert len((tmp_path / "run" / "estimate.tum").read_text().splitlines()) > 100


WATCH = LocalizerConfig(extrinsics_monitor=ExtrinsicsMonitorConfig(stretches=2))


def doubts(world: PreparedMap, readings: list[Reading], mounts: Mounts) -> set[str]:
    """All reported reasons that concern mounts."""
    localizer = Localizer(world, mounts, WATCH)
    reasons = {reason for r in readings for reason in localizer.add(r).reasons}
    return {reason for reason in reasons if "mounted" in reason}


def test_monitor_names_a_wrong_mount_while_driving_and_no_correct_one(
    hall: PreparedMap, readings: list[Reading]
) -> None:
    assert doubts(hall, readings, MOUNTS) == set()
    off = np.array([0.0, 0.03, 0.0, 0.0, 0.0, 0.0])
    named = doubts(hall, readings, corrected(MOUNTS, "laser_vertical", off))
    assert named
    assert all("laser_vertical seems mounted about" in reason for reason in named)
    assert all("cm off in y against laser_horizontal" in reason for reason in named)
