"""Cartesian stiffness of robots with elastic links, elastic actuators and passive joints.

    import robostiff as rs

    robot = rs.load("gough-stewart-b")
    result = rs.stiffness(robot, [0, 0, 0.8, 0, 0, 0])
    result.K, result.rank, result.free_motions, result.status

Names are imported when they are first used, so that the command line starts at once; they are
listed in ``__init__.pyi``, which type checkers read as well.
"""

from robostiff.on_demand import import_on_demand

import_on_demand(__name__)
