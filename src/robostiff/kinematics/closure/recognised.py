"""The closed form of a chain, if it has one."""

from __future__ import annotations

from robostiff.kinematics.closure.post import Post, recognise_post
from robostiff.kinematics.closure.rod import Rod, recognise_rod, recognise_sliding_rod
from robostiff.kinematics.closure.skeleton import skeleton_of
from robostiff.kinematics.closure.strut import Strut, recognise_strut
from robostiff.model import Chain

ClosedForm = Strut | Rod | Post
_KEPT = "_closed_form"  # attribute of a chain


def recognised(path: Chain) -> ClosedForm | None:
    """The closed form of a chain without blocks, kept with it: several legs may have one."""
    kept = vars(path)
    if _KEPT not in kept:
        kept[_KEPT] = _closed_form(path)
    return kept[_KEPT]


def _closed_form(path: Chain) -> ClosedForm | None:
    """By given points first, then by meeting axes."""
    for joined in (False, True):
        skeleton = skeleton_of(path, joined_where_axes_meet=joined)
        for recognise in (recognise_strut, recognise_rod, recognise_sliding_rod, recognise_post):
            if (found := recognise(skeleton)) is not None:
                return found
    return None
