"""The picture of the README: a platform that can turn about its apex, and the matrix that says so.

python docs/make_picture.py docs/_static/gough-stewart-a.png
"""

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import TwoSlopeNorm
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from scipy.spatial.transform import Rotation

import robostiff as rs

# Okabe and Ito's colours, which can be distinguished with all kinds of colour vision.
BLUE, ORANGE, GREEN, GREY, INK = "#0072B2", "#D55E00", "#009E73", "#8C8C8C", "#222222"
TURN_COLOURS = {"x": ORANGE, "y": GREEN, "z": BLUE}

ELEVATION, AZIMUTH = 17.0, 42.0  # deg, from where one looks
TOWARDS_VIEWER = Rotation.from_euler("ZY", [AZIMUTH, -ELEVATION], degrees=True).apply([1, 0, 0])


def main() -> None:
    robot = rs.load("gough-stewart-a", {"r": "250 mm", "h": "450 mm"})
    result = rs.stiffness(robot)

    mpl.use("Agg")
    mpl.rcParams.update({"font.family": "DejaVu Sans", "text.color": INK})
    from matplotlib import pyplot as plt

    figure = plt.figure(figsize=(11, 5.2), dpi=110, facecolor="white")
    space = figure.add_axes((-0.02, -0.07, 0.54, 1.04), projection="3d", computed_zorder=False)
    assert isinstance(space, Axes3D)  # noqa: S101
    draw_robot(space, rs.find_posture(robot).snapshot)
    draw_free_rotations(space, result)
    draw_matrix(figure.add_axes((0.535, 0.1, 0.43, 0.73)), result)
    title = {"y": 0.935, "fontsize": 13, "ha": "center", "weight": "bold"}
    figure.text(0.25, s="free: three rotations about the apex", **title)
    figure.text(0.75, s=f"stiffness matrix, rank {int(result.rank)} of 6", **title)
    figure.savefig(Path(sys.argv[1]), metadata={"Software": None})


def draw_robot(axes: Axes3D, snapshot: rs.Snapshot) -> None:
    """Base, platform, legs, and the lines along the legs that meet in the apex."""
    feet = np.array([leg.elements[0].point.reshape(3) for leg in snapshot.legs])
    heads = np.array([leg.end.reshape(3) for leg in snapshot.legs])
    apex = common_point(feet, heads)
    near = feet @ TOWARDS_VIEWER > 0

    draw_plate(axes, feet, "#E4E4E4", zorder=1)
    draw_legs(axes, feet[~near], heads[~near], zorder=2)
    draw_plate(axes, heads, "#BFD9EA", zorder=4)
    draw_legs(axes, feet[near], heads[near], zorder=5)
    for head in heads:
        line = {"color": GREY, "linewidth": 1, "linestyle": (0, (4, 4)), "zorder": 7}
        axes.plot(*np.array([head, apex]).T, **line)
    for joints in (feet, heads):
        ring = {"color": "white", "edgecolor": INK, "linewidth": 1.4, "zorder": 8}
        axes.scatter(*joints.T, s=30, depthshade=False, **ring)

    axes.set_xlim(-0.55, 0.55)
    axes.set_ylim(-0.55, 0.55)
    axes.set_zlim(-0.04, 1.16)
    axes.set_box_aspect((1.1, 1.1, 1.2), zoom=1.16)
    axes.view_init(elev=ELEVATION, azim=AZIMUTH)
    axes.set_axis_off()


def draw_plate(axes: Axes3D, corners: np.ndarray, shade: str, zorder: int) -> None:
    plate = Poly3DCollection([corners], facecolor=shade, edgecolor=GREY, linewidth=1.2)
    plate.set_zorder(zorder)
    axes.add_collection3d(plate)


def draw_legs(axes: Axes3D, feet: np.ndarray, heads: np.ndarray, zorder: int) -> None:
    look = {"color": INK, "linewidth": 2.6, "solid_capstyle": "round", "zorder": zorder}
    for foot, head in zip(feet, heads, strict=True):
        axes.plot(*np.array([foot, head]).T, **look)


def common_point(feet: np.ndarray, heads: np.ndarray) -> np.ndarray:
    """Point nearest to all leg lines."""
    along = (heads - feet) / np.linalg.norm(heads - feet, axis=1, keepdims=True)
    across = np.eye(3) - along[:, :, None] * along[:, None, :]
    return np.linalg.solve(across.sum(axis=0), np.einsum("lij,lj->i", across, feet))


def draw_free_rotations(axes: Axes3D, result: rs.Stiffness) -> None:
    """An arrow about each line that the platform can turn about."""
    for motion in result.free_motions:
        centre, e = motion.screw.point, motion.screw.axis
        assert motion.screw.is_rotation and centre is not None  # noqa: S101, PT018
        name = "xyz"[int(np.argmax(np.abs(e)))]
        colour = TURN_COLOURS[name]
        line = np.array([centre - 0.2 * e, centre + 0.27 * e])
        axes.plot(*line.T, color=colour, linewidth=1.6, zorder=9)
        first = TOWARDS_VIEWER - e * (e @ TOWARDS_VIEWER)
        first /= np.linalg.norm(first)
        angle = np.linspace(0.4 * np.pi, 1.93 * np.pi, 90)[:, None]
        circle = np.cos(angle) * first + np.sin(angle) * np.cross(e, first)
        circle = centre + 0.17 * e + 0.075 * circle
        axes.plot(*circle.T, color=colour, linewidth=2.2, solid_capstyle="round", zorder=10)
        draw_arrow_head(axes, circle[-1], circle[-1] - circle[-4], colour)
        label = {"color": colour, "fontsize": 14, "ha": "center", "va": "center"}
        axes.text(*(centre + 0.33 * e), f"$r_{name}$", **label)
    axes.scatter(*result.free_motions[0].screw.point, s=36, color=INK, depthshade=False, zorder=11)


def draw_arrow_head(axes: Axes3D, tip: np.ndarray, along: np.ndarray, colour: str) -> None:
    along = along / np.linalg.norm(along)
    across = np.cross(along, TOWARDS_VIEWER)
    across /= np.linalg.norm(across)
    corners = [tip + 0.045 * along, tip + 0.023 * across, tip - 0.023 * across]
    head = Poly3DCollection([corners], facecolor=colour, edgecolor=colour)
    head.set_zorder(10)
    axes.add_collection3d(head)


def draw_matrix(axes: Axes, result: rs.Stiffness) -> None:
    """K as numbers, shaded by size with rotations multiplied by a length."""
    K = result.K
    s = np.repeat([1.0, float(result.length)], 3)
    shade = K / np.outer(s, s)
    shade /= np.abs(shade).max()
    shade[np.abs(shade) < 1e-12] = 0.0
    axes.imshow(
        np.sign(shade) * np.abs(shade) ** 0.5, cmap="PuOr_r", norm=TwoSlopeNorm(0, -1.25, 1.25)
    )
    for i, j in np.ndindex(6, 6):
        text, colour = ("0", "#B0B0B0") if shade[i, j] == 0 else (f"{K[i, j] / 1e6:.1f}", INK)
        axes.text(j, i, text, ha="center", va="center", fontsize=11.5, color=colour)
    axes.set_xticks(range(6), [f"${name[0]}{name[1]}$" for name in result.space.twist_order])
    axes.set_yticks(range(6), [f"${name[0]}_{name[1]}$" for name in result.space.wrench_order])
    axes.xaxis.tick_top()
    axes.tick_params(length=0, labelsize=12)
    axes.axhline(2.5, color=INK, linewidth=1)
    axes.axvline(2.5, color=INK, linewidth=1)
    axes.set_xlabel("MN/m,  MN/rad,  MN m/rad", fontsize=11, labelpad=10)
    for spine in axes.spines.values():
        spine.set_color(INK)


if __name__ == "__main__":
    main()
