from robostiff.analysis.maps.map import stiffness_map
from robostiff.analysis.maps.pose_source import Axis, Grid, PoseList, RandomPoses
from robostiff.analysis.maps.request import Batched, Compiled
from robostiff.analysis.maps.run import Progress, Threads
from robostiff.analysis.maps.variables import Quantity

__all__ = [
    "Axis",
    "Batched",
    "Compiled",
    "Grid",
    "PoseList",
    "Progress",
    "Quantity",
    "RandomPoses",
    "Threads",
    "stiffness_map",
]
