"""Solvers of the legs of a robot: closed forms are recognised, and assembly modes are chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from robostiff.errors import InputError, OpenAtHomeError, Words
from robostiff.kept import kept
from robostiff.kinematics.closure.arm import Arm, arm_of
from robostiff.kinematics.closure.leg_forms import (
    Cluster,
    Post,
    Slide,
    copied_places,
    nearest,
    on_turn_of_home,
    rounding_of,
    skeleton_of,
)
from robostiff.kinematics.closure.leg_solver import CLOSED, ClosedForm, LegSolver
from robostiff.kinematics.closure.loops import attachment_frame
from robostiff.kinematics.closure.rods import Rod, rod_of, strut_of
from robostiff.kinematics.frames import place_chain
from robostiff.kinematics.jacobians import in_groups
from robostiff.kinematics.turn import turn_by_vector
from robostiff.model import Chain, Elbow, Leg, Robot

_PARALLEL = 1e-9  # sine: rounding
_ROUNDING = 1e-13  # of a distance from the origin


def legs_alike(solvers: Sequence[LegSolver]) -> list[tuple[tuple[int, ...], LegSolver]]:
    """Legs of a robot in groups of equal chains, closed in the same assembly mode or by steps.

    Each group are numbers of legs, and one solver for all of them.
    """

    def alike(one: LegSolver, other: LegSolver) -> bool:
        modes = [own.closed_form and own.closed_form.mode for own in (one, other)]
        same = modes[0] == modes[1] and one.leg.elbow is other.leg.elbow
        return same and one.chain == other.chain

    found = []
    for group in in_groups(solvers, alike):
        own = [solvers[i] for i in group]
        legs, homes = tuple(one.leg for one in own), np.stack([one.home for one in own])
        found.append((group, own[0] if len(own) == 1 else replace(own[0], legs=legs, homes=homes)))
    return found


def leg_solvers(legs: Sequence[Leg], home_pose: np.ndarray, length: float) -> tuple[LegSolver, ...]:
    """The solvers that close legs of a robot, of size `length`, at its home pose (6,).

    Raises InputError when a leg does not close there, or an elbow is named for a leg that has no
    choice.
    """
    solvers = []
    for leg in legs:
        chain = leg.chain
        # No closed form takes joints that follow one another.
        copies = None if chain.is_coupled else copied_places(chain)
        form = None if copies is None else _closed_form(chain.main_path)
        if leg.elbow is not Elbow.HOME and not isinstance(form, Rod):
            raise InputError(
                f"elbow of leg {leg.name!r}",
                got=leg.elbow.value,
                expected="none: only a slide or crank with a rod has two ways in closed form",
                hint="choose the working mode of this leg by the home coordinates of its joints",
            )
        if form is None or copies is None:
            copies = np.arange(chain.size)
        solvers.append(LegSolver((leg,), form, copies, home_pose, chain.home[None], length))
    found: dict[int, LegSolver] = {}
    for places, group in legs_alike(solvers):
        found |= zip(places, _in_modes_of_home(group), strict=True)
    return tuple(found[i] for i in range(len(legs)))


def _in_modes_of_home(group: LegSolver) -> list[LegSolver]:
    """Each leg in the assembly mode that is nearest to home, or iterated where none closes it."""
    form, chain = group.closed_form, group.chain
    if form is None:
        return [_checked(one.closed_at_home()) for one in group.each]
    pose, number = group.home_pose[None], len(group.legs)
    R = turn_by_vector(pose[:, 3:])
    every, closes = (x[:, :, 0] for x in group.in_modes(group.modes, pose, R))
    given = chain.home_given[chain.main_places]
    chosen = nearest(chain, every, closes, chain.home, given, form.leading, group.length)
    homes = on_turn_of_home(chain, every[chosen, range(number)], chain.home)
    if isinstance(form, Arm):  # where drives can move alone, home says how they stand
        own = np.tile(chain.home, (number, 1))
        drawn = group.closes(own, R, pose[:, :3])[:, None]
        homes = np.where(drawn, on_turn_of_home(chain, own, chain.home), homes)
    found = []
    for k, one in enumerate(group.each):
        own = replace(one, closed_form=form.in_mode(group.modes[chosen[k]]), homes=homes[k : k + 1])
        if not closes[chosen[k], k] and chain.has_blocks and own.gap_at_home()[1] > CLOSED:
            own = own.closed_at_home()
        found.append(own if closes[chosen[k], k] else _checked(own))
    return found


def _checked(solver: LegSolver) -> LegSolver:
    """The solver of a leg that closes at home; an `OpenAtHomeError` says where it does not."""
    loop, size = solver.gap_at_home()
    if size > CLOSED:
        (shift, turn), where = (float(x[0]) for x in loop.gap), loop.name
        place = f"at the end of branch {where!r}" if where else "at the platform"
        raise OpenAtHomeError(
            f"home configuration of leg {solver.leg.name!r}",
            got=Words(f"a gap of {shift:.4g} m and {np.degrees(turn):.4g} deg {place}"),
            expected="a leg that closes at the home pose"
            + (", and branches that end where the first one does" if where else ""),
            hint="check its dimensions and the directions of its frames and axes, or give the "
            "joints home coordinates near the closed configuration",
        )
    return solver


@kept
def _closed_form(path: Chain) -> ClosedForm | None:
    """The closed form of a chain without blocks: by given points first, then by meeting axes."""
    for joined in (False, True):
        found, skeleton = None, skeleton_of(path, joined_where_axes_meet=joined)
        match skeleton.parts:
            case (Cluster() as joint,):
                found = Post(skeleton, joint.places[0], (False, False, False), (joint,), joint)
            case (Cluster() as A, Slide() as slide, Cluster() as B):
                found = strut_of(skeleton, A, slide, B)
            case (Cluster() as A, Slide() as slide, Cluster() as turn, Cluster() as B):
                if _is_parallel(turn, slide) and turn.axes[0] @ slide.axis > 0:
                    found = strut_of(skeleton, A, slide, B, turn)
            case (Slide() | Cluster() as drive, Cluster() as A, Cluster() as B):
                found = rod_of(skeleton, drive, A, B)
            case (Slide() as slide, Cluster() as crank, Cluster() as A, Cluster() as B):
                # a crank and a rod in a plane, and a slide across the plane
                if all(_is_parallel(joint, slide) for joint in (crank, A, B)):
                    rod = rod_of(skeleton, crank, A, B)
                    found = rod and replace(rod, across=slide)
        if found := found or arm_of(skeleton):
            return found
    return None


def _is_parallel(joint: Cluster, slide: Slide) -> bool:
    """Whether a joint turns about one axis, along a slide."""
    if joint.is_ball or len(joint.axes) != 1:
        return False
    return bool(np.linalg.norm(np.cross(joint.axes[0], slide.axis)) <= _PARALLEL)


def reach(robot: Robot, home_pose: np.ndarray) -> float:
    """Size of a robot [m]: the largest distance between a leg's two ends, or its chain's extent."""
    R = turn_by_vector(home_pose[3:])
    ends = [attachment_frame(leg, R, home_pose[:3])[1] - leg.base.p for leg in robot.legs]
    chains = {id(leg.chain): leg.chain for leg in robot.legs}  # several legs may have one
    placed = [place_chain(one, one.home, np.eye(3), np.zeros(3)) for one in chains.values()]
    sizes = [np.linalg.norm(x) for x in (*ends, *(e.point for c in placed for e in c.parts))]
    size = float(max(sizes))
    # What is all in one point has no extent but rounding.
    far = max(np.linalg.norm(p) for p in (home_pose[:3], *(leg.base.p for leg in robot.legs)))
    rounding = max(_ROUNDING * float(far), *map(rounding_of, chains.values()))
    return size if size > rounding else 1.0
