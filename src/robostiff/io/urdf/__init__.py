"""URDF: robot descriptions of ROS, read by yourdfpy; xacro by xacrodoc."""

from robostiff.io.urdf.read import expand_xacro, read_urdf

__all__ = ["expand_xacro", "read_urdf"]
