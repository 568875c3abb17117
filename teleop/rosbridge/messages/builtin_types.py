"""Types that clients expect of every server and that the type store of rosbags lacks."""

from __future__ import annotations

from typing import Final

MESSAGES: Final = {
    "rosbridge_msgs/ConnectedClient": "string ip_address\nbuiltin_interfaces/Time connection_time",
    "rosbridge_msgs/ConnectedClients": "rosbridge_msgs/ConnectedClient[] clients",
    "tf2_web_republisher/TFArray": "geometry_msgs/TransformStamped[] transforms",
}

_SUM: Final = "int64 a\nint64 b\n---\nint64 sum"

SERVICES: Final = {
    "std_srvs/Empty": "---",
    "std_srvs/Trigger": "---\nbool success\nstring message",
    "std_srvs/SetBool": "bool data\n---\nbool success\nstring message",
    "example_interfaces/AddTwoInts": _SUM,
    "rospy_tutorials/AddTwoInts": _SUM,
    "nav_msgs/GetMap": "---\nnav_msgs/OccupancyGrid map",
    "tf2_web_republisher/RepublishTFs": (
        "string[] source_frames\nstring target_frame\nfloat32 angular_thres\nfloat32 trans_thres\n"
        "float32 rate\nbuiltin_interfaces/Duration timeout\n---\nstring topic_name"
    ),
}

_FIBONACCI: Final = "int32 order\n---\nint32[] sequence\n---\nint32[] sequence"
_TRANSFORMS: Final = (
    "string[] source_frames\nstring target_frame\nfloat32 angular_thres\nfloat32 trans_thres\n"
    "float32 rate\n---\n---\ngeometry_msgs/TransformStamped[] transforms"
)

ACTIONS: Final = {
    "actionlib/Test": "int32 goal\n---\nint32 result\n---\nint32 feedback",
    "actionlib_tutorials/Fibonacci": _FIBONACCI,
    "example_interfaces/Fibonacci": _FIBONACCI,
    "tf2_web_republisher/TFSubscription": _TRANSFORMS,
    "tf2_web_republisher_interfaces/TFSubscription": _TRANSFORMS,
}
