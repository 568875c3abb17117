"""Types of ``control_msgs`` and ``moveit_msgs`` that clients of an arm send, and that the type store of rosbags lacks.

Fields in the order of the packages of ROS 2 (control_msgs 5, moveit_msgs 2), on which a client of ROS 1 agrees in
what it sends, and a client of JSON in what it may leave out.
"""

from __future__ import annotations

from typing import Final

MESSAGES: Final = {
    "control_msgs/JointJog": (
        "std_msgs/Header header\nstring[] joint_names\nfloat64[] displacements\n"
        "float64[] velocities\nfloat64 duration"
    ),
    "control_msgs/GripperCommand": "float64 position\nfloat64 max_effort",
    "control_msgs/JointTolerance": (
        "string name\nfloat64 position\nfloat64 velocity\nfloat64 acceleration"
    ),
    "control_msgs/JointComponentTolerance": (
        "string joint_name\nuint16 component\nfloat64 position\nfloat64 velocity\n"
        "float64 acceleration"
    ),
    "object_recognition_msgs/ObjectType": "string key\nstring db",
    "moveit_msgs/ServoStatus": (
        "int8 INVALID = -1\nint8 NO_WARNING = 0\nint8 DECELERATE_FOR_APPROACHING_SINGULARITY = 1\n"
        "int8 HALT_FOR_SINGULARITY = 2\nint8 DECELERATE_FOR_LEAVING_SINGULARITY = 3\n"
        "int8 DECELERATE_FOR_COLLISION = 4\nint8 HALT_FOR_COLLISION = 5\nint8 JOINT_BOUND = 6\n"
        "int8 code\nstring message"
    ),
    "moveit_msgs/MoveItErrorCodes": (
        "int32 SUCCESS=1\nint32 FAILURE=99999\nint32 PLANNING_FAILED=-1\n"
        "int32 INVALID_MOTION_PLAN=-2\nint32 MOTION_PLAN_INVALIDATED_BY_ENVIRONMENT_CHANGE=-3\n"
        "int32 CONTROL_FAILED=-4\nint32 UNABLE_TO_AQUIRE_SENSOR_DATA=-5\nint32 TIMED_OUT=-6\n"
        "int32 PREEMPTED=-7\nint32 START_STATE_IN_COLLISION=-10\n"
        "int32 START_STATE_VIOLATES_PATH_CONSTRAINTS=-11\nint32 START_STATE_INVALID=-26\n"
        "int32 GOAL_IN_COLLISION=-12\nint32 GOAL_VIOLATES_PATH_CONSTRAINTS=-13\n"
        "int32 GOAL_CONSTRAINTS_VIOLATED=-14\nint32 GOAL_STATE_INVALID=-27\n"
        "int32 UNRECOGNIZED_GOAL_TYPE=-28\nint32 INVALID_GROUP_NAME=-15\n"
        "int32 INVALID_GOAL_CONSTRAINTS=-16\nint32 INVALID_ROBOT_STATE=-17\n"
        "int32 INVALID_LINK_NAME=-18\nint32 INVALID_OBJECT_NAME=-19\n"
        "int32 FRAME_TRANSFORM_FAILURE=-21\nint32 COLLISION_CHECKING_UNAVAILABLE=-22\n"
        "int32 ROBOT_STATE_STALE=-23\nint32 SENSOR_INFO_STALE=-24\n"
        "int32 COMMUNICATION_FAILURE=-25\nint32 CRASH=-29\nint32 ABORT=-30\n"
        "int32 NO_IK_SOLUTION=-31\nint32 val\nstring message\nstring source"
    ),
    "moveit_msgs/CollisionObject": (
        "byte ADD=0\nbyte REMOVE=1\nbyte APPEND=2\nbyte MOVE=3\nstd_msgs/Header header\n"
        "geometry_msgs/Pose pose\nstring id\nobject_recognition_msgs/ObjectType type\n"
        "shape_msgs/SolidPrimitive[] primitives\ngeometry_msgs/Pose[] primitive_poses\n"
        "shape_msgs/Mesh[] meshes\ngeometry_msgs/Pose[] mesh_poses\n"
        "shape_msgs/Plane[] planes\ngeometry_msgs/Pose[] plane_poses\n"
        "string[] subframe_names\ngeometry_msgs/Pose[] subframe_poses\nbyte operation"
    ),
    "moveit_msgs/AttachedCollisionObject": (
        "string link_name\nmoveit_msgs/CollisionObject object\nstring[] touch_links\n"
        "trajectory_msgs/JointTrajectory detach_posture\nfloat64 weight"
    ),
    "moveit_msgs/RobotState": (
        "sensor_msgs/JointState joint_state\nsensor_msgs/MultiDOFJointState multi_dof_joint_state\n"
        "moveit_msgs/AttachedCollisionObject[] attached_collision_objects\nbool is_diff"
    ),
    "moveit_msgs/BoundingVolume": (
        "shape_msgs/SolidPrimitive[] primitives\ngeometry_msgs/Pose[] primitive_poses\n"
        "shape_msgs/Mesh[] meshes\ngeometry_msgs/Pose[] mesh_poses"
    ),
    "moveit_msgs/JointConstraint": (
        "string joint_name\nfloat64 position\nfloat64 tolerance_above\nfloat64 tolerance_below\n"
        "float64 weight"
    ),
    "moveit_msgs/PositionConstraint": (
        "std_msgs/Header header\nstring link_name\ngeometry_msgs/Vector3 target_point_offset\n"
        "moveit_msgs/BoundingVolume constraint_region\nfloat64 weight"
    ),
    "moveit_msgs/OrientationConstraint": (
        "uint8 XYZ_EULER_ANGLES=0\nuint8 ROTATION_VECTOR=1\nstd_msgs/Header header\n"
        "geometry_msgs/Quaternion orientation\nstring link_name\n"
        "float64 absolute_x_axis_tolerance\nfloat64 absolute_y_axis_tolerance\n"
        "float64 absolute_z_axis_tolerance\nuint8 parameterization\nfloat64 weight"
    ),
    "moveit_msgs/VisibilityConstraint": (
        "uint8 SENSOR_Z=0\nuint8 SENSOR_Y=1\nuint8 SENSOR_X=2\nfloat64 target_radius\n"
        "geometry_msgs/PoseStamped target_pose\nint32 cone_sides\n"
        "geometry_msgs/PoseStamped sensor_pose\nfloat64 max_view_angle\nfloat64 max_range_angle\n"
        "uint8 sensor_view_direction\nfloat64 weight"
    ),
    "moveit_msgs/Constraints": (
        "string name\nmoveit_msgs/JointConstraint[] joint_constraints\n"
        "moveit_msgs/PositionConstraint[] position_constraints\n"
        "moveit_msgs/OrientationConstraint[] orientation_constraints\n"
        "moveit_msgs/VisibilityConstraint[] visibility_constraints"
    ),
    "moveit_msgs/PositionIKRequest": (
        "string group_name\nmoveit_msgs/RobotState robot_state\nmoveit_msgs/Constraints constraints\n"
        "bool avoid_collisions\nstring ik_link_name\ngeometry_msgs/PoseStamped pose_stamped\n"
        "string[] ik_link_names\ngeometry_msgs/PoseStamped[] pose_stamped_vector\n"
        "builtin_interfaces/Duration timeout"
    ),
}

SERVICES: Final = {
    "moveit_msgs/ServoCommandType": (
        "int8 JOINT_JOG = 0\nint8 TWIST = 1\nint8 POSE = 2\nint8 command_type\n---\nbool success"
    ),
    "moveit_msgs/GetPositionIK": (
        "moveit_msgs/PositionIKRequest ik_request\n---\nmoveit_msgs/RobotState solution\n"
        "moveit_msgs/MoveItErrorCodes error_code"
    ),
    "moveit_msgs/GetPositionFK": (
        "std_msgs/Header header\nstring[] fk_link_names\nmoveit_msgs/RobotState robot_state\n---\n"
        "geometry_msgs/PoseStamped[] pose_stamped\nstring[] fk_link_names\n"
        "moveit_msgs/MoveItErrorCodes error_code"
    ),
    "file_server/GetBinaryFile": "string name\n---\nuint8[] value",
}

_GRIPPER: Final = "float64 position\nfloat64 effort\nbool stalled\nbool reached_goal"

ACTIONS: Final = {
    "control_msgs/FollowJointTrajectory": (
        "trajectory_msgs/JointTrajectory trajectory\n"
        "trajectory_msgs/MultiDOFJointTrajectory multi_dof_trajectory\n"
        "control_msgs/JointTolerance[] path_tolerance\n"
        "control_msgs/JointComponentTolerance[] component_path_tolerance\n"
        "control_msgs/JointTolerance[] goal_tolerance\n"
        "control_msgs/JointComponentTolerance[] component_goal_tolerance\n"
        "builtin_interfaces/Duration goal_time_tolerance\n---\n"
        "int32 SUCCESSFUL = 0\nint32 INVALID_GOAL = -1\nint32 INVALID_JOINTS = -2\n"
        "int32 OLD_HEADER_TIMESTAMP = -3\nint32 PATH_TOLERANCE_VIOLATED = -4\n"
        "int32 GOAL_TOLERANCE_VIOLATED = -5\nint32 error_code\nstring error_string\n---\n"
        "std_msgs/Header header\nstring[] joint_names\n"
        "trajectory_msgs/JointTrajectoryPoint desired\ntrajectory_msgs/JointTrajectoryPoint actual\n"
        "trajectory_msgs/JointTrajectoryPoint error\nstring[] multi_dof_joint_names\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_desired\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_actual\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_error"
    ),
    "control_msgs/GripperCommand": (
        f"control_msgs/GripperCommand command\n---\n{_GRIPPER}\n---\n{_GRIPPER}"
    ),
}
