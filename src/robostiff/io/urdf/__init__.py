"""URDF: robots as the ROS world describes them, read by yourdfpy; xacro by xacrodoc."""

from robostiff.io.urdf.read import read_urdf
from robostiff.io.urdf.xacro import expand_xacro

__all__ = ["expand_xacro", "read_urdf"]
