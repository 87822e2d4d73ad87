"""Loop closures of a tree: those that a description tells, and those of a side file."""

from __future__ import annotations

from dataclasses import dataclass

from robostiff.io.model_file.build_joint import build_joint
from robostiff.io.model_file.build_link import build_spring
from robostiff.io.model_file.geometry import transform
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.written_elements import WrittenSpring
from robostiff.io.rigid_tree.choices import check_known
from robostiff.io.rigid_tree.tree import JointType, RigidTree
from robostiff.io.rigid_tree.written_side import LinkFrameChoice, WrittenLoop, WrittenSide
from robostiff.model import Joint, Link, Passive, spherical
from robostiff.spatial import Frame


@dataclass(frozen=True)
class Loop:
    """Frames on two links that coincide, but for the motion of what is between them.

    Attributes
    ----------
    name : str
    links : (str, str)
    frames : (Frame, Frame)
        One in the frame of each link.
    element : Joint, Link or None
        A joint, a spring, or nothing: then they are welded.
    """

    name: str
    links: tuple[str, str]
    frames: tuple[Frame, Frame]
    element: Joint | Link | None


def build_loops(top: Place, written: WrittenSide, tree: RigidTree) -> list[Loop]:
    """The loops of the tree, then those of the side file."""
    loops = [
        Loop(
            loop.name,
            loop.links,
            loop.frames,
            spherical(Passive(), name=loop.name) if loop.type is JointType.SPHERICAL else None,
        )
        for loop in tree.loops
    ]
    taken = {joint.name for joint in tree.joints} | {loop.name for loop in loops}
    for i, entry in enumerate(written.loops):
        place = top / "loops" / i
        name = entry.name or f"loop{i + 1}"
        if name in taken:
            raise (place / "name").error(
                "name of the loop", got=name, expected="a name no joint or loop has"
            )
        taken.add(name)
        loops.append(_loop(place, entry, name, tree))
    return loops


def _loop(place: Place, entry: WrittenLoop, name: str, tree: RigidTree) -> Loop:
    (link_a, frame_a), (link_b, frame_b) = (
        _frame(place / "between" / i, choice, tree) for i, choice in enumerate(entry.between)
    )
    if link_a == link_b:
        raise (place / "between").error(
            "links of the loop", got=link_a, expected="two different links"
        )
    written, here = entry.joint, place / "joint"
    if isinstance(written, str):
        element = None if written == "fixed" else spherical(Passive(), name=name)
    elif isinstance(written, WrittenSpring):
        element = build_spring(here, written, name)
    else:
        element = build_joint(here, written, name)
    return Loop(name, (link_a, link_b), (frame_a, frame_b), element)


def _frame(place: Place, choice: LinkFrameChoice, tree: RigidTree) -> tuple[str, Frame]:
    if isinstance(choice, str):
        return check_known(place, choice, "link", tree.links), Frame.identity()
    check_known(place / "link", choice.link, "link", tree.links)
    return choice.link, transform(place, choice)
