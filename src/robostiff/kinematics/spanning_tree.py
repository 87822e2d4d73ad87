"""Connected bodies: the spanning tree and loops that others close, branches, separate parts."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Generic, Protocol, TypeVar

from robostiff.frozen import frozen


class _Connecting(Protocol):
    @property
    def name(self) -> str: ...

    @property
    def a(self) -> str: ...

    @property
    def b(self) -> str: ...


Edge = TypeVar("Edge", bound=_Connecting)
Node = TypeVar("Node")


@frozen
class SpanningTree(Generic[Edge]):
    """Which connections lead to the bodies, and which close loops."""

    # for every body that is connected with the base, in an order that walks outwards: the
    # connections from the base to it, each with 1 where it is passed from a to b, otherwise -1
    ways: Mapping[str, tuple[tuple[Edge, float], ...]]
    cuts: tuple[Edge, ...]  # those that close loops

    @cached_property
    def in_loops(self) -> frozenset[str]:
        """Names of the connections that are part of a loop."""
        return frozenset(c.name for cut in self.cuts for c, _ in self.around(cut))

    def around(self, cut: Edge) -> tuple[tuple[Edge, float], ...]:
        """The loop that a connection closes, which comes first.

        Signs are 1 for what moves the end of the cut, -1 for what moves the body that it meets.
        """
        here, there = self.ways[cut.a], self.ways[cut.b]
        shared = {c.name for c, _ in here} & {c.name for c, _ in there}
        one = tuple((c, sign) for c, sign in here if c.name not in shared)
        other = tuple((c, -sign) for c, sign in there if c.name not in shared)
        return ((cut, 1.0), *one, *other)


def spanning_tree(base: str, connections: Iterable[Edge]) -> SpanningTree[Edge]:
    """The tree of the connections that come first; those that close loops are later ones."""
    group: dict[str, str] = {}
    at: dict[str, list[Edge]] = {base: []}
    cuts = []
    for connection in connections:
        a, b = representative(group, connection.a), representative(group, connection.b)
        if a == b:
            cuts.append(connection)
            continue
        group[b] = a
        for body in (connection.a, connection.b):
            at.setdefault(body, []).append(connection)
    ways: dict[str, tuple[tuple[Edge, float], ...]] = {base: ()}
    waiting = deque([base])
    while waiting:
        body = waiting.popleft()
        for connection in at[body]:
            forward = connection.a == body
            other = connection.b if forward else connection.a
            if other not in ways:
                ways[other] = (*ways[body], (connection, 1.0 if forward else -1.0))
                waiting.append(other)
    return SpanningTree(ways, tuple(cut for cut in cuts if cut.a in ways))


def branches(
    connections: Sequence[tuple[str, str]], ends: Collection[str]
) -> Iterator[tuple[str, str, list[tuple[int, bool]]]]:
    """Series paths between bodies at which the connections branch.

    They pass through bodies of two connections, and end at all others, at the given `ends`, and at
    one body of a ring that touches none of these.

    Parameters
    ----------
    connections : sequence of (str, str)
        The two bodies of each, which differ.
    ends : collection of str
        Bodies at which every path ends. Paths begin at the first of them where they can.

    Yields
    ------
    start, end : str
        Bodies.
    path : list of (int, bool)
        Numbers of connections on the way, each with whether it is passed forwards.
    """
    at: dict[str, list[int]] = {body: [] for body in ends}
    for number, pair in enumerate(connections):
        for body in pair:
            at.setdefault(body, []).append(number)
    branching = {body for body, own in at.items() if len(own) != 2}.union(ends)
    seen: set[int] = set()
    for start in sorted(at, key=lambda body: body not in branching):
        for first in at[start]:
            if first in seen:
                continue
            branching.add(start)
            body, own, path = start, first, []
            while True:
                a, b = connections[own]
                path.append((own, body == a))
                body = b if body == a else a
                if body in branching:
                    break
                (own,) = (other for other in at[body] if other != own)
            seen.update(number for number, _ in path)
            yield start, body, path


def representative(group: dict[Node, Node], node: Node) -> Node:
    """The node that stands for all that are connected with this one.

    The group has a connected node of each that does not stand for itself; ways through it are
    shortened.
    """
    while (nearer := group.get(node, node)) != node:
        group[node] = node = group.get(nearer, nearer)
    return node


def connected_parts(nodes: Iterable[Node], edges: Iterable[Iterable[Node]]) -> dict[Node, Node]:
    """For each node the first one, in their order, that edges connect with it."""
    order = {node: i for i, node in enumerate(dict.fromkeys(nodes))}
    group: dict[Node, Node] = {}
    for ends in edges:
        firsts = {representative(group, node) for node in ends}
        if len(firsts) > 1:
            first = min(firsts, key=order.__getitem__)
            group |= dict.fromkeys(firsts - {first}, first)
    return {node: representative(group, node) for node in order}


def independent_parts(
    nodes: Iterable[Node], edges: Sequence[Collection[Node]]
) -> list[tuple[list[Node], list[int]]]:
    """Nodes that edges connect, and the numbers of these edges; an edge without a node is alone."""
    first = connected_parts(nodes, edges)
    parts: dict[Node, tuple[list[Node], list[int]]] = {own: ([], []) for own in first.values()}
    for node, own in first.items():
        parts[own][0].append(node)
    alone = []
    for k, ends in enumerate(edges):
        if ends:
            parts[first[next(iter(ends))]][1].append(k)
        else:
            alone.append(([], [k]))
    return [*parts.values(), *alone]
