from __future__ import annotations

import bz2
import gzip
import lzma
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from localization.logs.carmen_lines import SCANNER
from localization.logs.carmen_log import CarmenLog
from localization.logs.log_interface import LogError
from localization.logs.open_log import open_log
from localization.maps.map_files import save_cloud
from localization.pipeline.log_replay import localize
from localization.types import Odometry, Pose, Scan
from tests.support_rooms import HALL, MOUNTS, Drive, Place

START = Pose.planar(2.6, 1.6, 0.2)
LOOP = ((1.0, 0.0, 0.0), (4.0, 0.5, 0.35), (2.0, 0.0, 0.8), (3.0, 0.4, -0.3), (1.0, 0.0, 0.0))
FORWARD = 0.15
"""Of the scanner on the base [m]."""


def flaser(place: Place, pose: Pose, odom: Pose, seconds: float, *, beams: int = 181) -> str:
    """A line such as CARMEN writes, of a scan from the height of our scanners."""
    rng = np.random.default_rng(round(seconds * 1e3))
    scanner = pose @ Pose.planar(FORWARD, 0.0, 0.0)
    angles = np.linspace(-math.pi / 2, math.pi / 2, beams) + scanner.yaw
    directions = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    origins = np.tile(
        scanner.position + MOUNTS["laser_horizontal"].position * [0, 0, 1], (beams, 1)
    )
    far = place.cast(origins, directions) + 0.01 * rng.standard_normal(beams)
    ranges = " ".join(f"{r:.2f}" for r in np.where(np.isfinite(far), far, 81.83))
    laser = odom @ Pose.planar(FORWARD, 0.0, 0.0)
    poses = " ".join(f"{p.position[0]:.6f} {p.position[1]:.6f} {p.yaw:.6f}" for p in (laser, odom))
    return f"FLASER {beams} {ranges} {poses} {seconds:.6f} robot {seconds - 100.0:.6f}"


def carmen(folder: Path, text: str) -> CarmenLog:
    """The log of a text."""
    path = folder / "a.log"
    path.write_text(text)
    return CarmenLog(path)


@pytest.fixture(scope="module")
def text() -> str:
    """A drive through the hall, with odometry that is 3 % wrong and began elsewhere."""
    drive = Drive(HALL, START, *LOOP)
    lines = ["# made by a test", "PARAM robot_front_laser_max 81.9"]
    for stamp in range(0, drive.end + 1, 100_000_000):
        step = drive.pose(0).inverse() @ drive.pose(stamp)
        odom = Pose.planar(9.0, 4.0, 1.0) @ Pose.planar(
            1.03 * step.position[0], 1.03 * step.position[1], 1.04 * step.yaw
        )
        seconds = 976052857.3 + stamp * 1e-9
        lines.append(flaser(HALL, drive.pose(stamp), odom, seconds))
        x, y, yaw = odom.position[0], odom.position[1], odom.yaw
        lines.append(f"ODOM {x:.6f} {y:.6f} {yaw:.6f} 0.4 0.1 0.0 {seconds + 0.01:.6f} robot 1.0")
    return "\n".join(lines) + "\n"


@pytest.fixture(scope="module")
def log(text: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("carmen") / "hall.log"
    path.write_text(text)
    return path


def test_scans_and_odometry_come_in_order_with_exact_stamps(log: Path) -> None:
    readings = list(CarmenLog(log))
    assert [type(r) for r in readings[:3]] == [Scan, Odometry, Odometry]
    assert readings[0].stamp == readings[1].stamp == 976052857_300000000
    assert readings[2].stamp == 976052857_310000000


def test_mount_follows_from_scanner_and_base_poses(log: Path) -> None:
    mount = CarmenLog(log).mounts[SCANNER]
    np.testing.assert_allclose(mount.position, [FORWARD, 0.0, 0.0], atol=1e-5)
    assert mount.yaw == pytest.approx(0.0, abs=1e-5)


def test_corrected_scanner_poses_give_no_mount(text: str, tmp_path: Path) -> None:
    lines = []
    for i, line in enumerate(x for x in text.splitlines() if x.startswith("FLASER")):
        words = line.split()
        words[183] = f"{float(words[183]) + 0.01 * i:.6f}"
        lines.append(" ".join(words))
    mount = carmen(tmp_path, "\n".join(lines)).mounts[SCANNER]
    np.testing.assert_array_equal(mount.position, np.zeros(3))


@pytest.mark.parametrize(
    ("beams", "step", "last"), [(181, 1.0, 90.0), (361, 0.5, 90.0), (180, 1.0, 89.0)]
)
def test_beams_span_the_half_circle_ahead(
    tmp_path: Path, beams: int, step: float, last: float
) -> None:
    scan = next(iter(carmen(tmp_path, flaser(HALL, START, START, 5.0, beams=beams))))
    assert isinstance(scan, Scan)
    assert np.rad2deg(scan.angles[[0, 1, -1]]) == pytest.approx(
        [-90.0, -90.0 + step, last], abs=1e-4
    )


def test_range_at_the_limit_means_no_echo(tmp_path: Path) -> None:
    scan = next(iter(carmen(tmp_path, "FLASER 3 1.5 81.83 2.5 0 0 0 0 0 0 7.25 robot 1.0\n")))
    assert isinstance(scan, Scan)
    np.testing.assert_array_equal(scan.ranges, [1.5, np.inf, 2.5])


def test_newer_laser_lines_carry_their_own_angles_and_poses(tmp_path: Path) -> None:
    head = "ROBOTLASER1 0 -2.0 4.0 1.0 30.0 0.01 0 5 1.0 2.0 3.0 4.0 30.0 2 7 8"
    poses = "1.2 0.0 0.0 1.0 0.0 0.0 0.1 0.2 0.3 0.3 1e6"
    log = carmen(tmp_path, f"{head} {poses} 12.5 robot 0.5\n")
    scan, odometry = list(log)
    assert isinstance(scan, Scan)
    assert isinstance(odometry, Odometry)
    np.testing.assert_allclose(scan.angles, [-2.0, -1.0, 0.0, 1.0, 2.0])
    np.testing.assert_array_equal(scan.ranges, [1.0, 2.0, 3.0, 4.0, np.inf])
    assert scan.stamp == odometry.stamp == 12_500_000_000
    np.testing.assert_allclose(log.mounts[SCANNER].position, [0.2, 0.0, 0.0], atol=1e-12)


def test_times_without_zeros_are_repaired(tmp_path: Path) -> None:
    """As in the log of the Intel Research Lab: ``976052917.910720`` was 0.091072 s past the second."""
    rng = np.random.default_rng(5)
    stamps = 976052917_000000000 + np.cumsum(rng.integers(40_000, 320_000, 120)) * 1000
    lines = []
    for stamp in stamps.tolist():
        seconds, microseconds = divmod(stamp // 1000, 1_000_000)
        printed = f"{microseconds}".ljust(6, "0")
        lines.append(f"FLASER 3 1.5 2.0 2.5 0 0 0 0 0 0 {seconds}.{printed} nohost 1.0\n")
    log = carmen(tmp_path, "".join(lines))
    assert len(log.warnings) == 1
    assert "zeros" in log.warnings[0]
    told = np.array([r.stamp for r in log if isinstance(r, Scan)])
    assert (np.diff(told) > 0).all()
    assert (told == stamps).mean() > 0.97


@pytest.mark.parametrize("pack", [gzip.compress, lzma.compress])
def test_cut_text_ends_with_its_last_whole_line_and_a_note_says_so(
    log: Path, text: str, tmp_path: Path, pack: Callable[[bytes], bytes]
) -> None:
    packed = tmp_path / "cut"
    data = pack(text.encode())
    packed.write_bytes(data[: 2 * len(data) // 3])
    whole, log_cut = list(CarmenLog(log)), CarmenLog(packed)
    assert 50 < len(list(log_cut)) < len(whole)
    assert any("its compressed data are cut short" in line for line in log_cut.warnings)


def test_damaged_gzip_is_read_up_to_the_damage_and_a_note_says_so(
    text: str, tmp_path: Path
) -> None:
    packed = tmp_path / "damaged.gz"
    data = bytearray(gzip.compress(4 * text.encode()))
    half = len(data) // 2
    data[half : half + 2000] = b"\xff" * 2000
    packed.write_bytes(data)
    log = CarmenLog(packed)
    assert 50 < len(list(log)) < 4 * text.count("\n")
    assert any("its compressed data are damaged" in line for line in log.warnings)


@pytest.mark.parametrize("pack", [gzip.compress, bz2.compress])
def test_text_before_garbage_or_a_wrong_checksum_is_read_and_a_note_says_so(
    pack: Callable[[bytes], bytes], text: str, tmp_path: Path
) -> None:
    whole, damaged = pack(text.encode()), bytearray(pack(text.encode()))
    damaged[-6] ^= 1
    packed = tmp_path / "log"
    packed.write_bytes(whole + damaged)
    log = CarmenLog(packed)
    assert len(list(log)) >= len(list(carmen(tmp_path, text)))
    assert any("its compressed data are damaged" in line for line in log.warnings)


def test_compressed_file_that_is_cut_before_its_first_line_is_named_as_such(
    text: str, tmp_path: Path
) -> None:
    packed = tmp_path / "log.bz2"
    packed.write_bytes(bz2.compress(text.encode())[:500])
    with pytest.raises(LogError, match="no scan, and its compressed data are cut short"):
        CarmenLog(packed)


def test_broken_lines_are_counted_with_the_reason(text: str, tmp_path: Path) -> None:
    lines = text.splitlines()
    lines[6] = "FLASER 181 1.0 2.0"
    lines[7] = "ODOM nan 0 0 0 0 0 976052858.0 robot 1"
    log = carmen(tmp_path, "\n".join(lines))
    whole = text.count("FLASER") * 2 + text.count("ODOM")
    assert len(list(log)) == whole - 3
    assert log.skipped["FLASER"].count == 1
    assert log.skipped["FLASER"].reason == "the line ends after 3 of at least 189 words"
    assert "finite" in log.skipped["ODOM"].reason


@pytest.mark.parametrize("time", ["inf", "nan", "-1.0", "1e999999", "1e10", "soon"])
def test_line_with_an_invalid_time_is_counted_with_it(text: str, tmp_path: Path, time: str) -> None:
    log = carmen(tmp_path, f"{text}\nODOM 0 0 0 0 0 0 {time} robot 1\n")
    list(log)
    assert log.skipped["ODOM"].reason.endswith(f"got {time}")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "empty"),
        ("hello\nworld\n", "holds no scan"),
        ("ODOM 0 0 0 0 0 0 1.0 robot 1\n", "holds no scan"),
        ("x\n" * 3000, "not a CARMEN log"),
    ],
)
def test_other_texts_are_rejected_in_one_line(tmp_path: Path, content: str, reason: str) -> None:
    path = tmp_path / "x.log"
    path.write_text(content)
    with pytest.raises(LogError, match=reason) as error:
        open_log(path)
    assert "\n" not in str(error.value)
    assert str(path) in str(error.value)


@pytest.mark.slow
def test_flat_log_is_localised_to_two_centimetres_from_a_rough_start(
    log: Path, tmp_path: Path
) -> None:
    # The log does not say how high its scanner is: the map is lowered to it.
    cloud = HALL.cloud()
    lowered = type(cloud)(
        cloud.points - [0.0, 0.0, MOUNTS["laser_horizontal"].position[2]],
        cloud.normals,
        name="hall",
    )
    save_cloud(lowered, tmp_path / "hall.ply")
    done = localize(
        log, tmp_path / "hall.ply", start=START @ Pose.planar(0.3, -0.2, 0.1), cache=None
    )
    drive = Drive(HALL, START, *LOOP)
    last = [e for e in done.estimates if e.map_from_base is not None][20:]
    assert len(last) > 100
    errors = []
    for estimate in last:
        assert estimate.map_from_base is not None
        error = drive.pose(estimate.stamp - 976052857_300000000).inverse() @ estimate.map_from_base
        errors.append([*error.position, error.yaw])
    worst = np.abs(errors).max(axis=0)
    assert np.hypot(worst[0], worst[1]) < 0.02
    assert worst[2] < 0.001
    assert worst[3] < np.deg2rad(1.0)
    assert np.sqrt(np.mean(np.square(errors)[:, 3])) < np.deg2rad(0.3)


# Times, hosts, and other formats


def stamped(number: int, seconds: str, host: str = "robot", logged: float | None = None) -> str:
    """A scan of three beams from x = number * 0.1 m, and its end as printed."""
    x = 0.1 * number
    logged = float(number) if logged is None else logged
    return f"FLASER 3 1.5 2.0 2.5 {x} 0 0 {x} 0 0 {seconds} {host} {logged:.6f}\n"


def test_pose_and_scan_of_one_instant_are_one_odometry_reading(tmp_path: Path) -> None:
    """CARMEN writes a pose as a line of its own and with the scan, in either order."""
    lines = []
    for i in range(6):
        odom = f"ODOM {0.1 * i} 0 0 0 0 0 {i}.5 robot {i}.0\n"
        pair = [odom, stamped(i, f"{i}.5")]
        lines += pair if i % 2 else pair[::-1]
    readings = list(carmen(tmp_path, "".join(lines)))
    odometry = [r for r in readings if isinstance(r, Odometry)]
    assert [r.stamp for r in odometry] == [i * 10**9 + 5 * 10**8 for i in range(6)]
    assert [r.odom_from_base.position[0] for r in odometry] == pytest.approx(
        [0.1 * i for i in range(6)]
    )
    assert sum(isinstance(r, Scan) for r in readings) == 6


def late(i: int) -> float:
    """Time of each line of a drive whose scans are written 50 ms late [s]."""
    return 0.02 * i - 0.05 * (i % 2)


def shaken(i: int) -> float:
    """Time of each line of a drive, wrong by up to 50 ms [s]."""
    return 0.02 * i + 0.05 * math.sin(7.0 * i)


@pytest.mark.parametrize(("printed", "true"), [(late, late), (shaken, lambda i: 0.02 * i)])
def test_poses_come_in_the_order_in_which_the_robot_drove_though_lines_are_late_or_stamped_wrongly(
    printed: Callable[[int], float], true: Callable[[int], float], tmp_path: Path
) -> None:
    lines = []
    for i in range(40):
        seconds, x = f"{1.0 + printed(i):.6f}", 1.0 + true(i)
        scan = f"FLASER 3 1.5 2.0 2.5 {x} 0 0 {x} 0 0 {seconds} robot {i}\n"
        lines.append(scan if i % 2 else f"ODOM {x} 0 0 0 0 0 {seconds} robot {i}\n")
    readings = list(carmen(tmp_path, "".join(lines)))
    driven = [r.odom_from_base.position[0] for r in readings if isinstance(r, Odometry)]
    assert np.min(np.diff([printed(i) for i in range(40)])) < 0.0
    assert np.min(np.diff(driven[8:])) > 0.0
    assert len(driven) == 40
    stamps = [r.stamp for r in readings]
    assert stamps == sorted(stamps)


@pytest.mark.parametrize(
    ("stamps", "logged", "said"),
    [
        (["1.00985e+09"] * 50, 1.00985e9, r"all 50 stamps are equal \(1\.00985e\+09 s\)"),
        (
            ["1.00980e+09"] * 50 + ["1.00981e+09"] * 50,
            1e9,
            "its 100 stamps have only 2 different values",
        ),
    ],
)
def test_equal_stamps_and_those_with_too_few_digits_are_rejected_with_the_remedy(
    tmp_path: Path, stamps: list[str], logged: float, said: str
) -> None:
    lines = (stamped(i, seconds, logged=logged) for i, seconds in enumerate(stamps))
    with pytest.raises(LogError, match=said) as error:
        carmen(tmp_path, "".join(lines))
    assert "use the raw log" in str(error.value)
    assert "\n" not in str(error.value)


def test_times_of_logging_stand_in_for_equal_stamps(tmp_path: Path) -> None:
    log = carmen(tmp_path, "".join(stamped(i, "1.00985e+09") for i in range(50)))
    assert [r.stamp for r in log if isinstance(r, Scan)] == [i * 10**9 for i in range(50)]
    assert "the times at which the lines were logged stand in" in log.warnings[0]


def test_scans_of_two_robots_in_turns_are_those_of_the_first(tmp_path: Path) -> None:
    lines = []
    for i in range(20):
        lines.append(stamped(i, f"{i}.0", "alice"))
        lines.append(stamped(100 + i, f"{i}.5", "bob"))
        lines.append(f"ODOM {9 + i} 0 0 0 0 0 {i}.6 bob 1.0\n")
        lines.append(f"ODOM {0.1 * i + 0.05} 0 0 0 0 0 {i}.7 alice 1.0\n")
    log = carmen(tmp_path, "".join(lines))
    odometry = [r for r in log if isinstance(r, Odometry)]
    assert len(odometry) == 40
    assert max(r.odom_from_base.position[0] for r in odometry) < 2.0
    scans, poses = log.warnings
    assert (
        "holds scans of 2 robots in turns: those of alice are read, 20 of bob are left out" in scans
    )
    assert "holds odometry of 2 robots" in poses


def test_laser_and_base_on_two_computers_are_one_robot(tmp_path: Path) -> None:
    lines = []
    for i in range(20):
        lines.append(stamped(i, f"{i}.0", "laptop"))
        lines.append(f"ODOM {0.1 * i + 0.05} 0 0 0 0 0 {i}.6 base 1.0\n")
    log = carmen(tmp_path, "".join(lines))
    assert log.warnings == ()
    assert sum(isinstance(r, Odometry) for r in log) == 40


def test_host_that_changes_once_is_named_and_read(tmp_path: Path) -> None:
    lines = (stamped(i, f"{i}.0", "old" if i < 12 else "new") for i in range(20))
    log = carmen(tmp_path, "".join(lines))
    assert sum(isinstance(r, Scan) for r in log) == 20
    (warning,) = log.warnings
    assert "changes from old to new at line 13" in warning


def test_text_that_begins_in_the_middle_of_a_line_is_named(text: str, tmp_path: Path) -> None:
    line = text.index("FLASER")
    (warning,) = carmen(tmp_path, text[line + 300 :]).warnings
    assert "begins in the middle of a line" in warning


def test_poses_alone_are_a_log_without_scanner(tmp_path: Path) -> None:
    poses = "".join(f"ODOM {0.1 * i} 0 0 0 0 0 {i}.5 robot {i}.0\n" for i in range(20))
    log = carmen(tmp_path, poses)
    assert log.mounts == {}
    last = localize(log.path).estimates[-1]
    assert last.map_from_base is not None
    assert last.map_from_base.position[0] == pytest.approx(1.9)


@pytest.mark.parametrize("pack", [bytes, gzip.compress])
@pytest.mark.parametrize(
    "name", [b"CSensoryFrame", b"CActionCollection", b"mrpt::obs::CObservation2D"]
)
def test_rawlog_of_mrpt_is_rejected_with_the_way_to_convert_it(
    tmp_path: Path, pack: Callable[[bytes], bytes], name: bytes
) -> None:
    path = tmp_path / "killian.rawlog"
    path.write_bytes(pack(bytes([0x80 | len(name)]) + name + b"\x02" + bytes(range(256)) * 40))
    with pytest.raises(LogError, match="is an MRPT rawlog") as error:
        open_log(path)
    assert "mrpt_rawlog_play" in str(error.value)
    assert "\n" not in str(error.value)
