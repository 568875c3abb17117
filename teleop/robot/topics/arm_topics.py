"""Table of the topics, actions and services of the arm, which there are only where there is an arm."""

from __future__ import annotations

from typing import Final

from teleop.robot.tick_record import DriveRecord
from teleop.robot.topics import arm_messages as arm
from teleop.robot.topics.table_rows import Interface, Topic

_TRIGGER: Final = "std_srvs/srv/Trigger"
_STAMPED: Final = "geometry_msgs/msg/PoseStamped"
ARM_OUTPUTS: tuple[Topic[DriveRecord], ...] = (
    Topic(
        "/arm/state",
        "farsteer_msgs/msg/ArmState",
        1,
        arm.arm_state,
        "what the arm does, why it does not move and what would help; 10 Hz while it stands",
    ),
    Topic(
        "/servo_node/status",
        "moveit_msgs/msg/ServoStatus",
        1,
        arm.servo_status,
        "the same as MoveIt Servo says it: codes -1 to 6; 10 Hz while it stands",
    ),
    Topic(
        "/arm/joint_degrees",
        "std_msgs/msg/Float64MultiArray",
        1,
        arm.joint_degrees,
        "commanded angles in degrees, and the gripper's servo's (0 closed to 180), for a second arm that follows",
    ),
    Topic(
        "/arm/servo_pulses",
        "std_msgs/msg/UInt16MultiArray",
        1,
        arm.servo_pulses,
        "widths of the servos' pulses in microseconds",
    ),
    Topic(
        "/arm/feedback",
        "sensor_msgs/msg/JoyFeedbackArray",
        0,
        arm.feedback,
        "vibration for a gamepad or a controller: contact, limit, refusal",
    ),
    Topic(
        "/arm/mirror",
        "farsteer_msgs/msg/ArmMirror",
        5,
        lambda tick: (),
        "how far a second arm is off that follows, and how far behind, once its angles have come",
    ),
)
"""Topics that the robot publishes tick by tick."""

ARM_INFO: Final = Interface(
    "/arm/info",
    "farsteer_msgs/msg/ArmInfo",
    "joints, limits, servos and named poses of the arm; latched",
)

HAND: Final = Interface(
    "/arm/hand",
    "farsteer_msgs/msg/Hand",
    "the operator's hand with its clutch: the tip follows from where it stands when the clutch closes",
)
HAND_POSE: Final = Interface(
    "/arm/hand_pose", _STAMPED, "the hand alone, for clients that send its clutch on `/arm/joy`"
)
HAND_JOY: Final = Interface(
    "/arm/joy",
    "sensor_msgs/msg/Joy",
    "`buttons[0]` clutch, `axes[0]` trigger 0 to 1; joined with `/arm/hand_pose` by the stamps",
)
TWIST: Final = Interface(
    "/servo_node/delta_twist_cmds",
    "geometry_msgs/msg/TwistStamped",
    "velocity of the tip [m/s, rad/s] in `arm_base`, `base_link` or `tool0`",
)
JOG: Final = Interface(
    "/servo_node/delta_joint_cmds", "control_msgs/msg/JointJog", "rates of joints [rad/s]"
)
POSE: Final = Interface(
    "/servo_node/pose_target_cmds", _STAMPED, "pose that the tip is led to, without a plan"
)
TRAJECTORY: Final = Interface(
    "/arm_controller/joint_trajectory",
    "trajectory_msgs/msg/JointTrajectory",
    "a timed motion of all joints, which begins at once where the arm stands",
)
CONFIRM: Final = Interface(
    "/arm/confirm",
    "std_msgs/msg/Bool",
    "true again and again while a motion with `hold_to_run` may go on",
)

MIRROR_DEGREES: Final = Interface(
    "/arm/mirror_degrees",
    "std_msgs/msg/Float64MultiArray",
    "angles of a second arm in degrees, from `farsteer servo-bridge`",
)

ARM_INPUTS: tuple[Interface, ...] = (
    HAND,
    HAND_POSE,
    HAND_JOY,
    TWIST,
    JOG,
    POSE,
    TRAJECTORY,
    CONFIRM,
    MIRROR_DEGREES,
)
"""Topics that the robot subscribes to."""

FOLLOW: Final = Interface(
    "/arm_controller/follow_joint_trajectory",
    "control_msgs/action/FollowJointTrajectory",
    "a timed motion of all joints, with tolerances",
)
GRIPPER: Final = Interface(
    "/gripper_controller/gripper_cmd",
    "control_msgs/action/GripperCommand",
    "opening [m] and largest force [N] of the gripper",
)
ARM_MOVE: Final = Interface(
    "/arm/move",
    "farsteer_msgs/action/ArmMove",
    "a collision-free way to a named pose, to angles or to a pose of the tip; previewed, and run while confirmed",
)

ARM_ACTIONS: Final = (FOLLOW, GRIPPER, ARM_MOVE)
"""Actions that the robot offers."""

SWITCH: Final = Interface(
    "/servo_node/switch_command_type",
    "moveit_msgs/srv/ServoCommandType",
    "take only this one of the caller's joint jogs (0), twists (1) and poses (2) from now on",
)
PAUSE: Final = Interface(
    "/servo_node/pause_servo",
    "std_srvs/srv/SetBool",
    "take none of the caller's jogs, twists and poses, and stop what they move",
)
COMPUTE_IK: Final = Interface(
    "/compute_ik",
    "moveit_msgs/srv/GetPositionIK",
    "angles for a pose of `tool0`, those nearest to the given ones; its turn about its own x axis is free",
)
COMPUTE_FK: Final = Interface(
    "/compute_fk", "moveit_msgs/srv/GetPositionFK", "poses of links for given angles"
)
STOW: Final = Interface("/arm/stow", _TRIGGER, "fold the arm for driving; answers when it is")
WAY_OUT: Final = Interface(
    "/arm/way_out", _TRIGGER, "do what `/arm/state` offers as `way_out`; answers when it is done"
)

ARM_SERVICES: Final = (SWITCH, PAUSE, COMPUTE_IK, COMPUTE_FK, STOW, WAY_OUT)
"""Services that the robot offers."""
