"""Table of the robot's topics and services: name, type, rate, and the builder of the messages."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from localization.maps.cloud import Cloud
from localization.types import Mounts, Pose
from robot_sim import DriveConfig, SkidSteer
from robot_sim.robot.camera_mount import camera_frames
from robot_sim.robot.urdf import urdf
from teleop.robot.arm.arm_fit import ArmFit
from teleop.robot.tick_record import DriveRecord, EstimateRecord
from teleop.robot.topics import (
    control_messages as control,
    diagnostics_messages as diagnostics,
    estimate_messages as estimate,
    ground_truth_messages as truth,
    lean_cloud as lean,
    sensor_messages as sensors,
)
from teleop.robot.topics.message_parts import Message
from teleop.robot.topics.table_rows import Interface as Interface, Record as Record, Topic as Topic

if TYPE_CHECKING:  # a robot without a camera loads nothing of one
    from robot_sim.cameras import CameraModel


DRIVE_OUTPUTS: tuple[Topic[DriveRecord], ...] = (
    Topic("/clock", "rosgraph_msgs/msg/Clock", 1, control.clock, "the robot's time"),
    Topic(
        "/scan",
        "sensor_msgs/msg/LaserScan",
        0,
        sensors.scans_of("laser_horizontal"),
        "horizontal scanner; a beam without return has range_max + 1",
    ),
    Topic(
        "/scan_vertical",
        "sensor_msgs/msg/LaserScan",
        0,
        sensors.scans_of("laser_vertical"),
        "transverse scanner",
    ),
    Topic(
        "/imu/data",
        "sensor_msgs/msg/Imu",
        1,
        sensors.imu,
        "gyro and accelerometer, and the attitude by both; its heading begins at 0 and drifts",
    ),
    Topic(
        "/joint_states",
        "sensor_msgs/msg/JointState",
        1,
        sensors.joint_states,
        "wheel rates of both sides",
    ),
    Topic(
        "/teleop/state",
        "farsteer_msgs/msg/TeleopState",
        5,
        control.teleop_state,
        "the driver, and the command in force",
    ),
    Topic(
        "/teleop/guard",
        "farsteer_msgs/msg/Guard",
        5,
        control.guard,
        "what the guard makes of the driver's command, and why; which way is free",
    ),
    Topic(
        "/bumper_state",
        "farsteer_msgs/msg/BumperState",
        1,
        sensors.bumper_state,
        "front and rear bumper segments, each ring from the robot's left; as ROSARIA publishes them",
    ),
    Topic(
        "/firmware/packet",
        "std_msgs/msg/UInt8MultiArray",
        0,
        sensors.firmware_packet,
        "with the firmware option, 10 Hz: the controller's standard packet, byte by byte",
    ),
    Topic(
        "/diagnostics",
        "diagnostic_msgs/msg/DiagnosticArray",
        50,
        diagnostics.drive_diagnostics,
        "for dashboards: bumpers, tilt, stalls, a fall; who drives, and whether ticks keep time; in messages of its own, localisation",
    ),
    Topic(
        "/ground_truth/odom",
        "nav_msgs/msg/Odometry",
        2,
        truth.true_odometry,
        "true pose and twist; simulation only",
    ),
    Topic(
        "/ground_truth/slip",
        "farsteer_msgs/msg/Slip",
        2,
        truth.true_slip,
        "true slip of the wheels, and the centres of rotation; simulation only",
    ),
    Topic(
        "/ground_truth/condition",
        "farsteer_msgs/msg/Condition",
        1,
        truth.true_condition,
        "touched objects by name; wheels on the ground, tilt, stalls, a fall; simulation only",
    ),
)
"""Topics that control fills, tick by tick, whatever the localiser does."""

ESTIMATE_OUTPUTS: tuple[Topic[EstimateRecord], ...] = (
    Topic("/tf", "tf2_msgs/msg/TFMessage", 2, estimate.tf, "`map` to `odom` to `base_link`"),
    Topic(
        "/odom",
        "nav_msgs/msg/Odometry",
        2,
        estimate.odom,
        "smooth pose in `odom` and twist; drifts",
    ),
    Topic(
        "/amcl_pose",
        "geometry_msgs/msg/PoseWithCovarianceStamped",
        5,
        estimate.amcl_pose,
        "the estimate in `map` with its covariance, once there is one",
    ),
    Topic(
        "/local_cloud",
        "sensor_msgs/msg/PointCloud2",
        0,
        estimate.local_cloud,
        "the last sweep in `map`: x y z, intensity (always 0), distance to the map [m], negative behind a mapped surface, NaN far from any; fewer points for a slow link",
        thin=estimate.thinner_cloud,
    ),
    Topic(
        "/local_cloud/lean",
        "farsteer_msgs/msg/LeanCloud",
        0,
        lean.lean_cloud,
        "the same for slow links, twice a second: at most 400 points of 7 bytes",
    ),
    Topic(
        "/localization/status",
        "farsteer_msgs/msg/LocalizationStatus",
        5,
        estimate.localization_status,
        "health with reasons, fit, NIS, sigmas",
    ),
    Topic(
        "/localization/hint_verdict",
        "farsteer_msgs/msg/HintVerdict",
        0,
        estimate.hint_verdict,
        "the verdict about a hint",
        latch=True,
    ),
    Topic(
        "/localization/candidates",
        "geometry_msgs/msg/PoseArray",
        5,
        estimate.candidates,
        "places between which a search has not decided yet, best first; empty if there are none",
    ),
    Topic(
        "/diagnostics",
        "diagnostic_msgs/msg/DiagnosticArray",
        50,
        diagnostics.localization_diagnostics,
        "for dashboards: localisation",
    ),
)
"""Topics that the estimator fills, as far as it has come."""

OUTPUTS: Final[tuple[Topic[Any], ...]] = (
    *DRIVE_OUTPUTS,
    *(topic for topic in ESTIMATE_OUTPUTS if topic.name != "/diagnostics"),
)
"""All topics that the robot publishes tick by tick, each once."""

GROUND_TRUTH: Final = frozenset(t.name for t in OUTPUTS if t.name.startswith("/ground_truth/"))
"""Topics of what only a simulation knows."""

TF_STATIC = Interface(
    "/tf_static",
    "tf2_msgs/msg/TFMessage",
    "poses of scanners, camera and arm on `base_link`; latched",
)
MAP_INFO = Interface(
    "/map_info",
    "farsteer_msgs/msg/MapInfo",
    "name, bounds, SHA-256 and named places of the map; latched",
)

ROBOT_DESCRIPTION = Interface(
    "/robot_description",
    "std_msgs/msg/String",
    "URDF of the robot, of boxes and cylinders; latched",
)

DRIVE_LIMITS = Interface(
    "/drive_limits",
    "farsteer_msgs/msg/DriveLimits",
    "how fast the robot answers a command, for those who foresee where it will be; latched",
)

LATCHED: Final = (TF_STATIC, MAP_INFO, ROBOT_DESCRIPTION, DRIVE_LIMITS)
"""Topics that are published once."""

INPUTS: tuple[Interface, ...] = (
    Interface(
        "/joy", "sensor_msgs/msg/Joy", "drive: `axes[1]` forward, `axes[0]` turn, deadman, turbo"
    ),
    Interface(
        "/unity/joy",
        "sensor_msgs/msg/Joy",
        "the same as `/joy`, under the name that the paper used",
    ),
    Interface("/cmd_vel", "geometry_msgs/msg/Twist", "drive without a joystick; no deadman"),
    Interface(
        "/initialpose",
        "geometry_msgs/msg/PoseWithCovarianceStamped",
        "a hint: all-zero covariance means the default sigma",
    ),
    Interface(
        "/turtle_control",
        "std_msgs/msg/String",
        'step commands as JSON: `{"distance": 0.5}`, `{"angle": 15}`, `{"movement": "up"}` (`down`, `left`, `right`), `{"action": "photo"}`',
    ),
)
"""Topics that the robot subscribes to."""

TURTLE_RESULT = Interface(
    "/turtle_control/result",
    "std_msgs/msg/String",
    "what became of each step and photograph of `/turtle_control`, as JSON",
)

ANSWERS: Final = (TURTLE_RESULT,)
"""Topics that are published when a client's request has been answered."""

MOVE = Interface(
    "/move",
    "farsteer_msgs/action/Move",
    "one step: straight on, a turn on the spot, or an arc; steps wait in a queue and are driven in order",
)

ACTIONS: Final = (MOVE,)
"""Actions that the robot offers."""

GET_FILE: Final = Interface(
    "/file_server/get_file",
    "file_server/srv/GetBinaryFile",
    "the robot's description as `package://farsteer/robot.urdf`, for ROS#; its shapes need no meshes",
)

SERVICES: tuple[Interface, ...] = (
    GET_FILE,
    Interface(
        "/sim/step",
        "farsteer_msgs/srv/Step",
        "lockstep only: advance by a number of 20 ms ticks; refused in real time",
    ),
    Interface("/teleop/estop", "std_srvs/srv/Trigger", "brake and stay braked"),
    Interface("/teleop/estop_reset", "std_srvs/srv/Trigger", "release the e-stop"),
    Interface(
        "/teleop/take_over", "std_srvs/srv/Trigger", "take the lease from the present driver"
    ),
    Interface(
        "/teleop/ask",
        "std_srvs/srv/Trigger",
        "ask the present driver for the robot; ends by an answer, by leaving, or after 30 s",
    ),
    Interface(
        "/teleop/give", "std_srvs/srv/Trigger", "driver only: give the robot to the one who asks"
    ),
    Interface("/teleop/refuse", "std_srvs/srv/Trigger", "driver only: refuse the one who asks"),
    Interface(
        "/teleop/guard_switch",
        "std_srvs/srv/SetBool",
        "driver only: false switches the guard off until the lease ends; true, by anybody who may drive, on",
    ),
    Interface(
        "/teleop/disconnect_client",
        "farsteer_msgs/srv/DisconnectClient",
        "operators only: disconnect a client by its number, and bar it for a time",
    ),
    Interface(
        "/teleop/session",
        "farsteer_msgs/srv/Session",
        "who the caller is to the robot, and what it may do",
    ),
    Interface(
        "/teleop/introduce",
        "farsteer_msgs/srv/Introduce",
        "give the caller a name, by which everybody sees it; once for each connection",
    ),
    Interface("/teleop/clients", "farsteer_msgs/srv/Clients", "who is connected: names and roles"),
    Interface(
        "/teleop/link",
        "farsteer_msgs/srv/LinkStatistics",
        "what has been sent to the caller and dropped for it, and its round trip",
    ),
    Interface(
        "/localization/preview_hint",
        "farsteer_msgs/srv/PreviewHint",
        "score a pose by the last sweep and change nothing; of each client the newest, ten a second",
    ),
    Interface(
        "/localization/undo",
        "std_srvs/srv/Trigger",
        "undo the last accepted hint, or the last pose that a global search set",
    ),
    Interface(
        "/localization/relocalize",
        "std_srvs/srv/Trigger",
        "search the whole map; one search at a time, one request a second from each client",
    ),
)
"""Services that the robot offers."""

_PLAYGROUND: Final = (
    ("set_entity_state", "put the robot, a box or a person down at rest elsewhere"),
    ("spawn_entity", "put a spare box or person down"),
    ("delete_entity", "take away what was put down"),
    ("get_entities", "names of the robot and of what was put down"),
    ("get_spawnables", "what can be put down"),
    ("get_named_poses", "starts and places of the scene"),
    ("reset_simulation", "scope 2: robot to its start, 4: boxes and people away, 6: both"),
    ("get_simulation_state", "playing or paused"),
    ("set_simulation_state", "pause (2), or go on (1)"),
    ("get_current_world", "name of the scene"),
    ("get_available_worlds", "names of the scenes"),
    ("slip", "have the wheels spin now"),
    ("world", "start anew, in another scene, with people, or with moved furniture"),
    ("link", "make the link of all clients worse, or good again"),
)

PLAYGROUND_SERVICES: Final = tuple(
    Interface(
        f"/playground/{name}",
        f"farsteer_msgs/srv/Playground{name.title()}"
        if name in ("slip", "world", "link")
        else "simulation_interfaces/srv/" + name.title().replace("_", ""),
        description,
    )
    for name, description in _PLAYGROUND
)
"""Services of ``farsteer serve --playground``."""

SHARE_SERVICES: Final = (
    Interface(
        "/teleop/share",
        "farsteer_msgs/srv/Share",
        "operators only: make a link to the console page, to watch or to drive, with an end",
    ),
    Interface(
        "/teleop/own_token",
        "farsteer_msgs/srv/OwnToken",
        "for a device that came by a link: a token of its own",
    ),
    Interface(
        "/teleop/tokens", "farsteer_msgs/srv/Tokens", "operators only: tokens of devices and links"
    ),
    Interface(
        "/teleop/revoke_token",
        "farsteer_msgs/srv/RevokeToken",
        "operators only: end a token, and disconnect its bearers",
    ),
)
"""Services of ``farsteer serve --lan``."""

_SIMULATION: Final = (
    ("GetSimulatorFeatures", "what is offered"),
    ("StepSimulation", "advance by 1 to 500 steps of 20 ms"),
    ("ResetSimulation", "put the robot at its start, and take away what was spawned"),
    ("GetSimulationState", "always paused: time goes on by steps alone"),
    ("SetSimulationState", "nothing, as there is no other state"),
    (
        "GetEntities",
        "names of the robot and of what was spawned; filters by name, category and tags",
    ),
    ("GetEntitiesStates", "the same with poses and velocities"),
    ("GetEntityInfo", "category, description and tags of an entity"),
    ("GetEntityState", "true pose and velocity of an entity, in `map`"),
    ("SetEntityState", "put an entity down at rest elsewhere; it stands on the ground"),
    ("SpawnEntity", "put a spare box or person down"),
    ("SpawnEntities", "put several down"),
    ("DeleteEntity", "take away what was spawned"),
    ("GetSpawnables", "what can be spawned"),
    ("GetNamedPoses", "starts (tag `spawn`) and places (`navigation_goal`)"),
    ("GetCurrentWorld", "name of the world"),
    ("LoadWorld", "not offered"),
    ("UnloadWorld", "not offered"),
    ("GetAvailableWorlds", "not offered"),
    ("SetEntityInfo", "not offered"),
    ("GetEntityBounds", "not offered"),
    ("GetNamedPoseBounds", "not offered"),
)

SIMULATION_SERVICES: Final = tuple(
    Interface(
        "/sim/" + re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower(),
        f"simulation_interfaces/srv/{name}",
        description,
    )
    for name, description in _SIMULATION
)
"""Services for the referee of a robot that was started for it."""

SIMULATION_ACTION: Final = Interface(
    "/sim/simulate_steps",
    "simulation_interfaces/action/SimulateSteps",
    "action: advance by any number of steps, with feedback after each",
)
"""Action for the referee."""


_NOMINAL: Final = DriveConfig()


def latched_messages(
    cloud: Cloud,
    robot: SkidSteer,
    mounts: Mounts,
    run_id: str = "",
    *,
    drive: DriveConfig = _NOMINAL,
    places: Mapping[str, Pose] = MappingProxyType({}),
    camera: CameraModel | None = None,
    arm: ArmFit | None = None,
) -> Mapping[Interface, Message]:
    """Return the messages that are published once, at the start.

    Args:
        cloud: The robot's map.
        robot: Its parameters.
        mounts: ``base_from_sensor`` of each sensor.
        run_id: Identity of this run of the robot.
        drive: Limits of its drive.
        places: Named places of the map.
        camera: The camera that it carries, if any.
        arm: The arm that it carries, if any.
    """
    place = None if camera is None else camera.place
    frames = mounts if place is None else {**mounts, **camera_frames(robot, place)}
    if arm is not None:
        frames = {**frames, "arm_base": arm.base_from_arm_base}
    return {
        TF_STATIC: estimate.tf_static(frames),
        MAP_INFO: estimate.map_info(cloud, run_id, places),
        ROBOT_DESCRIPTION: {"data": _description(robot, mounts, place, arm)},
        DRIVE_LIMITS: control.drive_limits(drive),
        **({} if arm is None else _arm_info(arm)),
    }


def _description(robot: SkidSteer, mounts: Mounts, camera: Pose | None, arm: ArmFit | None) -> str:
    if arm is None:
        return urdf(robot, mounts, camera=camera)
    return urdf(robot, mounts, camera=camera, arm=arm.table, arm_mount=arm.mount)


def _arm_info(arm: ArmFit) -> Mapping[Interface, Message]:
    """Return what is published once about an arm; imported here, since most robots have none."""
    from teleop.robot.topics.arm_messages import arm_info
    from teleop.robot.topics.arm_topics import ARM_INFO

    return {ARM_INFO: arm_info(arm)}
