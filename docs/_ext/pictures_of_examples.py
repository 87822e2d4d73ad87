"""Which pictures of an example go on its page, and in which order the pages come.

A picture is any Matplotlib axes or figure that a part of an example has given a name.
Sphinx-Gallery itself looks for pyplot's figures only, and robostiff makes none.
"""

from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst

DPI = 130

#: From the question that comes first to those of one's own robot.
ORDER = (
    "three_free_rotations_of_a_hexapod.py",
    "stiffer_screws_or_stiffer_joints.py",
    "how_stiff_for_how_much_mass.py",
    "how_much_a_hexapod_carries.py",
    "where_a_delta_robot_is_stiff.py",
    "orthoglide_against_3_puu.py",
    "zeroing_rows_is_wrong.py",
    "redundant_joints_break_the_inverse.py",
    "closed_form_of_a_new_robot.py",
)


def keep_pictures(
    block: tuple[Any, ...], block_vars: dict[str, Any], gallery_conf: dict[str, Any]
) -> str:
    """Save the figures that are new in a part of an example; the reST that shows them."""
    names = block_vars["example_globals"]
    kept: list[Figure] = names.setdefault("_kept_figures", [])
    paths = []
    for value in list(names.values()):
        figure = value.get_figure(root=True) if isinstance(value, Axes) else value
        if not isinstance(figure, Figure) or any(figure is other for other in kept):
            continue
        path = next(block_vars["image_path_iterator"])
        figure.savefig(path, dpi=DPI, metadata={"Software": None})
        kept.append(figure)
        paths.append(path)
    return figure_rst(paths, gallery_conf["src_dir"])


def first_page_first(name: str) -> tuple[int, str]:
    """Key that sorts the files; one that is not listed comes last."""
    name = Path(name).name
    return (ORDER.index(name) if name in ORDER else len(ORDER), name)
