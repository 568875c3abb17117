import numpy as np
from numpy.testing import assert_array_equal

from localization.logs.ros_geometry import (
    pose_from_message,
    pose_from_transform,
    pose_to_dict,
    transform_to_dict,
    vector_to_dict,
)
from localization.types import Pose

POSE = Pose(np.array([1.0, -2.0, 0.5]), np.array([0.1, -0.2, 0.3, 0.9]))


def assert_same(a: Pose, b: Pose) -> None:
    assert_array_equal(a.position, b.position)
    assert_array_equal(a.quaternion_wxyz, b.quaternion_wxyz)


def test_pose_is_restored_from_a_dictionary_exactly() -> None:
    assert_same(pose_from_message(pose_to_dict(POSE)), POSE)
    assert_same(pose_from_transform(transform_to_dict(POSE)), POSE)


def test_quaternion_keeps_the_names_of_its_parts() -> None:
    w, x, y, z = POSE.quaternion_wxyz.tolist()
    assert pose_to_dict(POSE)["orientation"] == {"x": x, "y": y, "z": z, "w": w}


def test_vector_has_the_axes_in_order() -> None:
    assert vector_to_dict(np.array([1.0, 2.0, 3.0])) == {"x": 1.0, "y": 2.0, "z": 3.0}
