"""Robots: descriptions (URDF, xacro, SDF, MJCF), kinematics, and the cameras on their links."""

from .collada import collada_to_glb
from .description import Geometry, Link, Material, RobotDescription, Visual
from .joint_bag_writer import write_joint_states
from .joint_bags import is_bag, read_joint_states
from .joint_motion import JointMotion
from .joint_points import JointPoint, joint_points
from .kinematics import WIDTHS
from .mjcf import CompiledModel
from .mounted import MountedCamera, place_camera
from .read import SUFFIXES, RobotModel, has_robot_root, read_robots
from .resolve import FileResolver, Missing, find_root, list_faults
from .robot import JointValues, Robot
from .sdf_cameras import SdfCamera
from .transforms import quaternion_matrices, quaternions_of

__all__ = [
    "SUFFIXES",
    "WIDTHS",
    "CompiledModel",
    "FileResolver",
    "Geometry",
    "JointMotion",
    "JointPoint",
    "JointValues",
    "Link",
    "Material",
    "Missing",
    "MountedCamera",
    "Robot",
    "RobotDescription",
    "RobotModel",
    "SdfCamera",
    "Visual",
    "collada_to_glb",
    "find_root",
    "has_robot_root",
    "is_bag",
    "joint_points",
    "list_faults",
    "place_camera",
    "quaternion_matrices",
    "quaternions_of",
    "read_joint_states",
    "read_robots",
    "write_joint_states",
]
