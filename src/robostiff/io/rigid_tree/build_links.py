"""Elastic links of a tree: from the joint of a link to its far end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from robostiff.io.model_file.build_link import build_beam, build_link
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.stock import Stock
from robostiff.io.model_file.written_elements import WrittenBeam, WrittenLink
from robostiff.io.rigid_tree.tree import RigidTree
from robostiff.io.rigid_tree.written_side import WrittenElasticLink, WrittenLinkBeam, check_known
from robostiff.io.suggest import Words, listing
from robostiff.linkage import Connection
from robostiff.model import Link
from robostiff.spatial import Frame

TOOL = "tool"
"""Name of the tool point among the ends of a link."""


@dataclass(frozen=True)
class LinkEnd:
    """Something that a link holds: a joint, a loop closure or the tool point."""

    name: str
    point: np.ndarray  # (3,), where, in the frame of the link [m]
    leads_on: bool  # whether it leads to the base, the platform, the tool or a loop


@dataclass(frozen=True)
class ElasticLink:
    """A link of two bodies with elasticity between them."""

    # from the body at its joint to the body at its far end; both have the frame of the link
    connection: Connection
    end: str  # what the far end holds


def build_links(
    top: Place,
    written: Mapping[str, WrittenElasticLink],
    tree: RigidTree,
    ends: Mapping[str, list[LinkEnd]],
    stock: Stock,
) -> dict[str, ElasticLink]:
    """The elastic links by name, where `ends` has what each link of the tree holds."""
    links = {}
    taken = {joint.name for joint in tree.joints} | {loop.name for loop in tree.loops}
    for name, entry in written.items():
        place = top / "links" / name
        check_known(place, name, "link", tree.links)
        end = _far_end(place, name, entry, ends.get(name, []))
        joint = tree.joint_into(name)
        start = np.zeros(3) if joint is None else joint.after.inverse.p + 0.0
        link = _link(place, name, entry, end.point - start, stock)
        own = f"link {name}" if name in taken else name
        connection = Connection(
            own, name, far_body(name), _at(start), link, _at(-start - np.asarray(link.to))
        )
        links[name] = ElasticLink(connection, end.name)
    return links


def far_body(link: str) -> str:
    """Name of the body at the far end of an elastic link."""
    return f"{link}, far end"


def _far_end(place: Place, name: str, entry: WrittenElasticLink, ends: list[LinkEnd]) -> LinkEnd:
    by_name = {end.name: end for end in ends}
    if entry.to is not None:
        return by_name[check_known(place / "to", entry.to, "end of the link", list(by_name))]
    leading = [end for end in ends if end.leads_on]
    if len(leading) == 1:
        return leading[0]
    if not leading:
        raise place.error(
            f"elastic link {name!r}",
            got=Words("no joint, loop or tool point beyond it that is connected to the platform"),
            expected="a link between the base and the tool",
            key=True,
        )
    raise place.error(
        f"elastic link {name!r}",
        got=Words(f"{len(leading)} places to which it leads: {listing([e.name for e in leading])}"),
        expected="to:, the name of one of them; what holds the others is its near end",
    )


def _link(place: Place, name: str, entry: WrittenElasticLink, to: np.ndarray, stock: Stock) -> Link:
    given: dict[str, Any] = {
        key: getattr(entry, key) for key in type(entry).model_fields if key != "to"
    }
    run = to.tolist()
    if not isinstance(entry, WrittenLinkBeam):
        return build_link(place, WrittenLink.model_construct(**given, to=run, name=name), name)
    if not np.any(np.abs(to) > 1e-12):
        raise place.error(
            f"beam {name!r}",
            got=Words("a joint and a next one at the same point"),
            expected="a link that has a length",
            hint="write type: link with a stiffness for a short part",
        )
    return build_beam(place, WrittenBeam.model_construct(**given, to=run, name=name), name, stock)


def _at(point: np.ndarray) -> Frame:
    return Frame(np.eye(3), point + 0.0)
