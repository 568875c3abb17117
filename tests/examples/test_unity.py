"""The scripts for Unity, compiled and run by Mono against declarations of Unity and ROS# that stand in for both."""

from __future__ import annotations

import shlex
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import pytest

from localization.geometry import FloatArray
from localization.maps.map_files import load_cloud
from localization.types import Pose
from robot_sim.arm.arm_table import load_arm
from robot_sim.robot.platforms import P3AT
from robot_sim.robot.urdf import urdf
from teleop.scenario.files.reading import read_scenario
from teleop.scenario.files.shipped import shipped_files
from teleop.scenario.pytest_plugin import RobotFactory
from teleop.scenario.referee.outcome import ExitStatus
from teleop.scenario.session.run import run_scenario

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = sorted((ROOT / "examples/unity").glob("*.cs"))
DECLARED = sorted(Path(__file__).with_name("unity").glob("*.cs"))
JSON = Path("/usr/lib/cli/Newtonsoft.Json-5.0/Newtonsoft.Json.dll")
MAP = ROOT / "scenes/office/cloud.ply"
UNITY_FROM_ROS = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Unity's x, y, z are ROS's -y, z, x."""
FLOAT = 2e-6
"""Unity computes in float32."""

pytestmark = [
    pytest.mark.process,
    pytest.mark.skipif(
        shutil.which("mcs") is None or not JSON.exists(),
        reason="there is no Mono compiler with Json.NET",
    ),
]


@dataclass(frozen=True)
class Shown:
    """An object of the scene, in Unity's axes."""

    position: FloatArray
    rotation: FloatArray
    scale: FloatArray
    points: int


class Program:
    """The scripts with a console program around them."""

    def __init__(self, file: Path) -> None:
        self.command = ["mono", str(file)]

    def run(self, *words: str, given: str = "") -> str:
        """Return what it prints."""
        done = subprocess.run(
            [*self.command, *words], input=given, capture_output=True, text=True, timeout=120
        )
        assert (done.returncode, done.stderr) == (0, ""), done.stdout
        return done.stdout

    def converted(self, kind: str, rows: FloatArray) -> FloatArray:
        """Return a conversion of each row."""
        given = "".join(f"{kind} {' '.join(map(repr, row))}\n" for row in rows.tolist())
        return _numbers(self.run("numbers", given=given))


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Program:
    file = tmp_path_factory.mktemp("unity") / "play.exe"
    checks = ["-langversion:7.2", "-warn:4", "-warnaserror"]  # Unity 2022.3 takes C# 9
    with_json = [f"-r:{JSON}", "-r:System.Core", "-r:System.Xml"]
    sources = [str(source) for source in (*SCRIPTS, *DECLARED)]
    subprocess.run(["mcs", *checks, *with_json, f"-out:{file}", *sources], check=True, timeout=120)
    return Program(file)


def test_points_and_sizes_have_the_axes_of_unity(program: Program) -> None:
    rows = np.random.default_rng(1).uniform(-30, 30, (50, 3))
    for kind, axes in (("point", UNITY_FROM_ROS), ("size", np.abs(UNITY_FROM_ROS))):
        np.testing.assert_allclose(program.converted(kind, rows), rows @ axes.T, rtol=FLOAT)


def test_rotations_turn_the_same_things_to_the_same_side(program: Program) -> None:
    rows = np.random.default_rng(2).uniform(-3, 3, (50, 3))
    poses = [Pose.from_euler([0.0] * 3, roll=r, pitch=p, yaw=y) for r, p, y in rows]
    expected = np.array([_in_unity(pose.rotation) for pose in poses])
    for kind, given in (
        ("rpy", rows),
        ("rotation", np.array([np.roll(pose.quaternion_wxyz, -1) for pose in poses])),
    ):
        turned = program.converted(kind, given)
        np.testing.assert_allclose([_rotation(row) for row in turned], expected, atol=FLOAT)
    back = program.converted("ros", np.hstack([np.zeros((50, 3)), turned]))[:, 3:]
    ours = [pose.rotation for pose in poses]
    np.testing.assert_allclose([_rotation(row) for row in back], ours, atol=FLOAT)


def test_a_hint_looks_where_the_mouse_was_dragged(program: Program) -> None:
    headings = np.radians([0.0, 30.0, 90.0, 179.0, -135.0])
    ahead = np.column_stack([np.cos(headings), np.sin(headings), np.zeros(5)]) @ UNITY_FROM_ROS.T
    places = np.random.default_rng(3).uniform(-30, 30, (5, 3))
    turned = program.converted("towards", ahead)
    found = program.converted("ros", np.hstack([places @ UNITY_FROM_ROS.T, turned]))
    for row, place, heading in zip(found, places, headings, strict=True):
        expected = Pose.from_euler(place, yaw=heading)
        np.testing.assert_allclose(row[:3], place, rtol=FLOAT)
        np.testing.assert_allclose(_rotation(row[3:]), expected.rotation, atol=FLOAT)


def test_the_map_file_is_read_as_python_reads_it(program: Program) -> None:
    found = _numbers(program.run("cloud", str(MAP)))
    np.testing.assert_allclose(found, load_cloud(MAP).points[::100] @ UNITY_FROM_ROS.T, rtol=FLOAT)


def test_links_and_shapes_stand_where_mujoco_has_those_of_the_urdf(program: Program) -> None:
    arm, robot = load_arm(), P3AT()
    text = urdf(robot, robot.mounts, arm=arm)
    compiler = '<mujoco><compiler fusestatic="false" discardvisual="false" balanceinertia="false"/></mujoco>'
    model = mujoco.MjModel.from_xml_string(text.replace("</robot>", compiler + "</robot>"))
    data = mujoco.MjData(model)
    angles = np.random.default_rng(4).uniform(arm.lower, arm.upper)
    positions = {joint.name: angle for joint, angle in zip(arm.joints, angles, strict=True)}
    positions |= {arm.gripper.joint: 0.04}
    for name, value in (positions | {"arm_jaw_right_joint": 0.02}).items():
        data.joint(name).qpos = value
    mujoco.mj_kinematics(model, data)
    words = [word for pair in positions.items() for word in map(str, pair)]
    shown = _objects(program.run("model", *words, given=text))
    links = {name: found[0] for name, found in shown.items()}
    for body in map(model.body, range(1, model.nbody)):
        link = links[body.name]
        np.testing.assert_allclose(
            link.position, UNITY_FROM_ROS @ data.body(body.name).xpos, atol=FLOAT
        )
        expected = _in_unity(data.body(body.name).xmat.reshape(3, 3))
        np.testing.assert_allclose(link.rotation, expected, atol=FLOAT)
    shapes = [_row(shape) for kind in ("Cube", "Cylinder") for shape in shown[kind]]
    expected_shapes = []
    for geom in range(model.ngeom):
        x, y, z = model.geom_size[geom]
        cylinder = model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER
        size = (2 * x, y, 2 * x) if cylinder else (2 * y, 2 * z, 2 * x)
        place = UNITY_FROM_ROS @ data.geom_xpos[geom]
        turned = _in_unity(data.geom_xmat[geom].reshape(3, 3))
        expected_shapes.append(np.concatenate([place, turned.ravel(), size]))
    for expected in expected_shapes:
        assert min(np.abs(shape - expected).max() for shape in shapes) < FLOAT
    for shape in shapes:
        assert min(np.abs(shape - expected).max() for expected in expected_shapes) < FLOAT


@pytest.mark.long
@pytest.mark.slow
def test_a_served_robot_is_shown_with_its_arm_turned_to_the_right_and_stopped(
    program: Program, farsteer_robot: RobotFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = farsteer_robot("office", pace="real", world={"arm": "s2"})
    monkeypatch.setenv("FARSTEER_URL", robot.url)
    before = robot.truth()
    said = program.run("show", "6")
    assert "/teleop/estop: " in said
    assert said.count("status: ") <= 1  # of the stick that is held during the e-stop
    assert "error" not in said
    shown = _objects(said)
    truth = robot.truth()
    assert abs(truth.turn_rate) < 0.01
    assert -1.5 < np.angle(np.exp(1j * (truth.heading - before.heading))) < -0.2
    base, tool = shown["base_link"][0], shown["tool0"][0]
    believed = Pose.from_euler([truth.x, truth.y, 0.0], yaw=truth.heading)
    np.testing.assert_allclose(base.position, UNITY_FROM_ROS @ believed.position, atol=0.05)
    np.testing.assert_allclose(base.rotation, _in_unity(believed.rotation), atol=0.02)
    assert shown["map office"][0].points == len(load_cloud(MAP).points)
    assert shown["local cloud"][0].points > 500
    arm = load_arm()
    stowed = zip((joint.name for joint in arm.joints), arm.poses["stow"], strict=True)
    words = [str(word) for pair in stowed for word in pair]
    expected = _objects(program.run("model", *words, given=urdf(P3AT(), P3AT().mounts, arm=arm)))
    reach = base.rotation.T @ (tool.position - base.position)
    np.testing.assert_allclose(reach, expected["tool0"][0].position, atol=0.01)


@pytest.mark.long
@pytest.mark.slow
def test_the_scripts_drive_the_papers_sequence(program: Program, tmp_path: Path) -> None:
    file = shipped_files()["from-ros-to-unity"]
    # About where the robot was set down, as an operator knows it: the heading is 2 degrees off.
    seen = ["12.4", "12.4", "1.6"]
    command = shlex.join([*program.command, "sequence", *seen])
    outcome = run_scenario(read_scenario(file), tmp_path, client=command, beside=file.parent)
    log = (tmp_path / "client.log").read_text(encoding="utf-8")
    assert outcome.status is ExitStatus.PASSED, log
    assert "status" not in log  # the server took all that was sent
    assert outcome.figures["hints"] == 1
    assert outcome.figures["distance"] > 2.0


def _numbers(text: str) -> FloatArray:
    return np.array([[float(word) for word in line.split()] for line in text.splitlines()])


def _in_unity(rotation: FloatArray) -> FloatArray:
    return np.asarray(UNITY_FROM_ROS @ rotation @ UNITY_FROM_ROS.T)


def _rotation(xyzw: FloatArray) -> FloatArray:
    return Pose(np.zeros(3), np.roll(xyzw, 1) / np.linalg.norm(xyzw)).rotation


def _objects(text: str) -> dict[str, list[Shown]]:
    found: dict[str, list[Shown]] = {}
    for line in text.splitlines():
        if line.startswith("object:"):
            _, name, numbers = line.split(":")
            row = np.array([float(word) for word in numbers.split()])
            shown = Shown(row[:3], _rotation(row[3:7]), row[7:10], int(row[10]))
            found.setdefault(name, []).append(shown)
    return found


def _row(shape: Shown) -> FloatArray:
    return np.concatenate([shape.position, shape.rotation.ravel(), shape.scale])
