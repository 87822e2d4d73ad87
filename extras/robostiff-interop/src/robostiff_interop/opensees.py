"""A network as a model of OpenSees: the commands of its input file, in Tcl or Python.

Beams are elements of a frame, bodies `rigidLink`; both are exact. OpenSees has constraints along
world axes only, so a joint is a `zeroLength` element, turned into the joint's axes, whose springs
are stiff where the joint is rigid. What these springs yield is left in the answer; it is in
proportion to 1 / stiffness.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count

import numpy as np

from robostiff.elasticity import UniformBeam, uniform_beam
from robostiff.elastostatics import DEFAULT_TOLERANCE
from robostiff.errors import InputError, Words
from robostiff.network import (
    BeamElement,
    JointElement,
    Network,
    SpringElement,
    equations_of,
    held_coordinates,
)
from robostiff_interop.written_network import in_one_ascii_line, warn_of_free_motions

#: Stiffness of springs in place of rigid joints, in units of that of the stiffest part.
STIFF = 1e5
_ROUNDING = 1e-12


@dataclass(frozen=True)
class OpenSeesCommand:
    """A command of OpenSees.

    Attributes
    ----------
    name : str
    arguments : tuple of str, int or float
    printed : bool
        Whether its answer is to be seen.
    """

    name: str
    arguments: tuple[str | int | float, ...] = ()
    printed: bool = False

    @property
    def in_tcl(self) -> str:
        """As a line of Tcl, in which loads stand inside their pattern.

        Examples
        --------
        >>> OpenSeesCommand("node", (1, 0.0, 0.5, 2.0)).in_tcl
        'node 1 0.0 0.5 2.0'
        """
        line = " ".join([self.name, *(str(own) for own in self.arguments)])
        if self.name == "pattern":
            return f"{line} {{"
        if self.name == "load":
            return f"    {line}\n}}"
        return f"puts [{line}]" if self.printed else line

    @property
    def in_python(self) -> str:
        """As a line of Python.

        Examples
        --------
        >>> OpenSeesCommand("nodeDisp", (7,), printed=True).in_python
        'print(ops.nodeDisp(7))'
        """
        line = f"ops.{self.name}({', '.join(repr(own) for own in self.arguments)})"
        return f"print({line})" if self.printed else line


def opensees_script(network: Network, *, in_python: bool = False, stiff: float = STIFF) -> str:
    """Input file of OpenSees that computes the compliance of a network.

    It builds the network as bodies, beams and springs, and prints the twist of the platform about
    the reference point for each unit load there, a column of the compliance matrix a line.

    Parameters
    ----------
    network : Network
    in_python : bool
        For the package openseespy, in place of Tcl.
    stiff : float
        Stiffness of springs in place of rigid joints, in units of that of the stiffest part.
        Larger ones yield less and cost digits.

    Raises
    ------
    InputError
        When a spring is neither a uniform beam nor along its own axes, or axes of a joint do not
        meet.

    Examples
    --------
    >>> from robostiff.elasticity import circle, material
    >>> from robostiff.network import Node, beam_between
    >>> wall, tip = Node("wall", np.zeros(3)), Node("tip", np.array([1.0, 0, 0]))
    >>> rod = beam_between(wall, tip, material("steel"), circle(0.02), name="rod")
    >>> network = Network("rod", (wall, tip), ("wall",), "tip", tip.point, beams=(rod,))
    >>> print(opensees_script(network).splitlines()[4])
    wipe
    """
    warn_of_free_motions(network, "OpenSees")
    commands = opensees_commands(network, stiff)
    # Python takes a coding from the first two lines, and would run what a name holds.
    lines = [
        "# A column of the compliance matrix a line, at the reference point (m, rad for N, N m).",
        "# Written by robostiff.",
        f"# Network {in_one_ascii_line(network.name)}.",
        f"# Rigid joints are springs, {stiff:g} times as stiff as the stiffest part.",
    ]
    if in_python:
        lines += ["import openseespy.opensees as ops", ""]
        lines += [command.in_python for command in commands]
    else:
        lines += ["wipe", *(command.in_tcl for command in commands)]
    return "\n".join(lines) + "\n"


def opensees_commands(network: Network, stiff: float = STIFF) -> list[OpenSeesCommand]:
    """Commands that build a network and load its platform, see `opensees_script`."""
    if network.couplings:
        raise InputError(
            f"OpenSees script of {network.name!r}",
            got=Words(f"coupled joints: {', '.join(repr(own.name) for own in network.couplings)}"),
            expected="joints that move by themselves",
        )
    equations = equations_of(network, DEFAULT_TOLERANCE)
    soft = [c.S[np.ix_(~c.rigid, ~c.rigid)] for c in equations.connections if not c.rigid.all()]
    stiffest = equations.stiffness / min((np.linalg.eigvalsh(S)[0] for S in soft), default=1.0)
    k = stiff * stiffest  # [N/m]
    model = _Model(network, (k, k * equations.length**2), equations.points)
    model.add("model", "basic", "-ndm", 3, "-ndf", 6)
    for node in network.nodes:
        model.bodies[node.name] = model.node(equations.points[node.name])
    held = held_coordinates(equations)
    for name, tag in model.bodies.items():
        flags = [int((name, row) in held) for row in range(6)]
        if any(flags):
            model.add("fix", tag, *flags)
    for beam in network.beams:
        own = uniform_beam(beam.tip_compliance, is_one=True)
        if own is None:
            raise _no_beam(f"beam {beam.name!r}")
        _add_beam(model, beam, own, beam.end, beam.rotation)
    for spring in network.springs:
        _add_spring(model, spring)
    for joint in network.joints:
        _add_joint(model, joint)
    _load_platform(model)
    return model.commands


@dataclass
class _Model:
    """What is being built, and its numbers."""

    network: Network
    stiff: tuple[float, float]
    points: dict[str, np.ndarray]
    commands: list[OpenSeesCommand] = field(default_factory=list)
    tags: Iterator[int] = field(default_factory=lambda: count(1))
    bodies: dict[str, int] = field(default_factory=dict)

    def add(self, name: str, *arguments: object, printed: bool = False) -> None:
        plain = tuple(own.item() if isinstance(own, np.generic) else own for own in arguments)
        self.commands.append(OpenSeesCommand(name, plain, printed))  # pyright: ignore[reportArgumentType]

    def node(self, point: np.ndarray) -> int:
        tag = next(self.tags)
        self.add("node", tag, *point)
        return tag

    def attached(self, body: str, point: np.ndarray) -> int:
        """A node at a point of a body."""
        if np.array_equal(point, self.points[body]):
            return self.bodies[body]
        tag = self.node(point)
        self.add("rigidLink", "beam", self.bodies[body], tag)
        return tag

    def zero_length(
        self,
        element: SpringElement | JointElement,
        point: np.ndarray,
        axes: np.ndarray,
        stiffness: Sequence[float | None],
    ) -> None:
        """Six springs along axes; None for a direction that is free."""
        ends = self.attached(element.a, point), self.attached(element.b, point)
        materials, directions = [], []
        for i, k in enumerate(stiffness, start=1):
            if k is not None:
                tag = next(self.tags)
                self.add("uniaxialMaterial", "Elastic", tag, float(k))
                materials.append(tag)
                directions.append(i)
        if materials:
            orient = (*axes[:, 0], *axes[:, 1])
            springs = ("-mat", *materials, "-dir", *directions, "-orient", *orient)
            self.add("element", "zeroLength", next(self.tags), *ends, *springs)


def _add_beam(
    model: _Model,
    element: BeamElement | SpringElement,
    own: UniformBeam,
    end: np.ndarray,
    axes: np.ndarray,
) -> None:
    """An element of a frame."""
    start = end - own.length * axes[:, 0]
    nodes = model.attached(element.a, start), model.attached(element.b, end)
    transformation, tag = next(model.tags), next(model.tags)
    model.add("geomTransf", "Linear", transformation, *axes[:, 2])
    if not (own.shear_y or own.shear_z):
        section = (own.EA, 1.0, 1.0, own.GJ, own.EIy, own.EIz)
        model.add("element", "elasticBeamColumn", tag, *nodes, *section, transformation)
        return
    section = (1.0, 1.0, own.EA, own.GJ, own.EIy, own.EIz, 1 / own.shear_y, 1 / own.shear_z)
    model.add("element", "ElasticTimoshenkoBeam", tag, *nodes, *section, transformation)


def _no_beam(subject: str) -> InputError:
    return InputError(
        f"{subject} for OpenSees",
        got=Words("a matrix with entries off its diagonal, as of a tapered beam"),
        expected="a uniform beam, or a spring along its own axes",
        hint="OpenSees has no element for a 6 x 6 matrix; CalculiX has",
    )


def _add_spring(model: _Model, spring: SpringElement) -> None:
    C, beams = spring.elasticity.compliance, spring.elasticity.beams
    if len(beams) == 1:
        _add_beam(model, spring, beams[0], spring.point, spring.rotation)
        return
    if np.any(C - np.diag(np.diagonal(C))) or spring.elasticity.freedoms.shape[1]:
        raise _no_beam(f"spring {spring.name!r}")
    stiff = np.repeat(model.stiff, 3)
    values = [1 / c if c > 0 else k for c, k in zip(np.diagonal(C), stiff, strict=True)]
    model.zero_length(spring, spring.point, spring.rotation, values)


def _add_joint(model: _Model, joint: JointElement) -> None:
    """Springs along perpendicular axes through one point, as joints of robots have them."""
    axes = _axes([freedom.axis for freedom in joint.freedoms])
    values: list[float | None] = [*[model.stiff[0]] * 3, *[model.stiff[1]] * 3]
    at = [freedom.point for freedom in joint.freedoms if freedom.turns]
    apart = any(not np.array_equal(point, at[0]) for point in at)
    for freedom in joint.freedoms:
        along = np.flatnonzero(np.abs(axes.T @ freedom.axis) > 1 - _ROUNDING)
        if len(along) != 1 or freedom.pitch or apart:
            raise InputError(
                f"joint {joint.name!r} for OpenSees",
                got=Words("axes that are oblique, apart, or of a screw"),
                expected="perpendicular axes through one point",
                hint="write a joint for each axis, with a body between them",
            )
        values[along[0] + 3 * freedom.turns] = freedom.stiffness
    model.zero_length(joint, at[0] if at else model.points[joint.a], axes, values)


def _axes(directions: list[np.ndarray]) -> np.ndarray:
    """Right-handed axes, two of them along the first two directions that are not parallel."""
    x = directions[0] if directions else np.eye(3)[0]
    others = [d for d in directions if abs(d @ x) < 1 - _ROUNDING]
    across = others[0] if others else np.cross(x, np.eye(3)[np.argmin(np.abs(x))])
    y = across / np.linalg.norm(across)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _load_platform(model: _Model) -> None:
    """Twists of the reference point under unit loads, one after the other."""
    tip = model.attached(model.network.platform, model.network.reference_point)
    # Exact; "Transformation" goes wrong, without a word, where a body is held in some directions.
    for name, *options in (
        ("constraints", "Lagrange"),
        ("numberer", "Plain"),
        ("system", "UmfPack"),
        ("integrator", "LoadControl", 1.0),
        ("algorithm", "Linear"),
        ("analysis", "Static", "-noWarnings"),
        ("timeSeries", "Constant", 1),
    ):
        model.add(name, *options)
    for load in np.eye(6)[list(model.network.space.rows)]:
        model.add("pattern", "Plain", 1, 1)
        model.add("load", tip, *load)
        model.add("analyze", 1)
        model.add("nodeDisp", tip, printed=True)
        model.add("remove", "loadPattern", 1)
