"""The page of the shipped robots, from their model files.

python docs/make_robots_page.py > docs/robots.md
"""

import sys

import robostiff as rs
from robostiff.robots import describe

HEAD = """\
# Shipped robots

Each is a model file in `src/robostiff/robots/`; its first lines say what it is and where its
numbers come from. Load one by name, `rs.load("hexapod")`, or give the name to any command.
`robostiff robots` lists them, and `rs.load(name, {"h": "750 mm"})` or `--set h=750mm` changes a
parameter.

This page is written by `docs/make_robots_page.py`.
"""

CABLES = """\
# Shipped cable robots

See [cable robots](cables.md). `rs.load("cable-8")` and the commands `stiffness`, `cables` and
`check` take them; `rs.shipped_cable_robots()` lists them.
"""

LINKAGES = """\
# Shipped linkages

Their loops are not made of legs, so that they are [networks](networks.md) at every configuration:
`rs.load("double-pantograph")` and the commands take them at home,
`rs.load_linkage("double-pantograph")` at any [joint coordinates](urdf.md#other-loops).
`rs.shipped_linkages()` lists them.
"""


def main() -> None:
    sys.stdout.write(page())


def page() -> str:
    """The whole page."""
    sections = [section(name) for name in rs.shipped_robots()]
    cables = [section(name) for name in rs.shipped_cable_robots()]
    linkages = [section(name) for name in rs.shipped_linkages()]
    parts = [HEAD, table(), *sections, CABLES, cable_table(), *cables, LINKAGES, *linkages]
    return "\n".join(parts)


def table() -> str:
    """All robots and their stiffness at home, in a table."""
    rows = ["| robot | legs | free coordinates | rank at home | K_xx, K_yy, K_zz at home [N/um] |"]
    rows.append("|---|---|---|---|---|")
    for name in rs.shipped_robots():
        robot = rs.load(name)
        assert isinstance(robot, rs.Robot)  # noqa: S101
        free = ", ".join(c.value for c in robot.coordinates) or "joints"
        home = rs.stiffness(robot)
        translations = range(home.space.translations)
        K = ", ".join(f"{home.K[i, i] / 1e6:.3g}" for i in translations)
        rank = f"{int(home.rank)} of {home.space.size}"
        rows.append(f"| [{name}](#{name}) | {len(robot.legs)} | {free} | {rank} | {K} |")
    return "\n".join(rows) + "\n"


def cable_table() -> str:
    """All cable robots and their stiffness at home, in a table."""
    rows = ["| robot | cables | rank at home, by stretching | K_xx, K_yy, K_zz at home [N/mm] |"]
    rows.append("|---|---|---|---|")
    for name in rs.shipped_cable_robots():
        robot = rs.load(name)
        assert isinstance(robot, rs.CableRobot)  # noqa: S101
        home = rs.stiffness(robot)
        K = ", ".join(f"{home.K[i, i] / 1e3:.3g}" for i in range(home.space.translations))
        rank = f"{int(home.rank)} of {home.space.size}, {int(home.held_rank)}"
        rows.append(f"| [{name}](#{name}) | {len(robot.cables)} | {rank} | {K} |")
    return "\n".join(rows) + "\n"


def section(name: str) -> str:
    """What one robot is, and its source."""
    robot = describe(name)
    return f"## {name}\n\n{robot.title}.\n\nSource: {robot.source}\n"


if __name__ == "__main__":
    main()
