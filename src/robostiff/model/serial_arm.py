"""Serial arms from tables of Denavit and Hartenberg, standard and modified.

The arm is an ordinary robot of one leg: revolute or prismatic joints about z of their frames, and a
rigid part for every link between them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np

from robostiff.errors import InputError, Words
from robostiff.frozen import frozen, replace
from robostiff.model.chain import Chain, Element
from robostiff.model.checks import check_distinct
from robostiff.model.joint import Actuated, prismatic, revolute
from robostiff.model.link import Rigid
from robostiff.model.mass import Mass
from robostiff.model.robot import Leg, Robot
from robostiff.model.subject import Coordinate
from robostiff.spatial import Frame, as_float, exact_number, is_formula
from robostiff.spatial.formula import Scalar, exact_array, is_possible

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

_AXIS = (0.0, 0.0, 1.0)
_UNITS = {"a": "m", "alpha": "rad", "d": "m", "theta": "rad"}
_ROUNDINGS = 4  # an angle that differs from a quarter turn by so few of them is meant as one


class DHConvention(Enum):
    """What a row of a table of Denavit and Hartenberg describes.

    ``STANDARD``, of the distal frames (Denavit and Hartenberg 1955, Paul): ``Rz(theta) Tz(d) Tx(a)
    Rx(alpha)``; the joint of the row comes first. ``MODIFIED``, of the proximal frames (Craig,
    Khalil): ``Rx(alpha) Tx(a) Rz(theta) Tz(d)``; the joint comes third, and ``alpha`` and ``a``
    are those that many books number by the joint before.
    """

    STANDARD = "standard"
    MODIFIED = "modified"


@frozen(kw_only=True)
class DHRow:
    """A row of a table of Denavit and Hartenberg.

    Attributes
    ----------
    a : float or formula
        Along x [m].
    alpha : float or formula
        About x [rad].
    d : float or formula
        Along z [m]; what is added to the coordinate of a joint that slides.
    theta : float or formula
        About z [rad]; what is added to the coordinate of a joint that turns (its offset).
    slides : bool
        Whether the joint slides along z; otherwise it turns about z.
    name : str
        Of the joint; ``joint1``, ``joint2`` ... when left out.
    masses : tuple of Mass
        Of the link behind the joint, their centres in the frame of the row; without a centre in the
        middle between the ends of the link.

    Examples
    --------
    >>> DHRow(a=0.4318).a
    0.4318
    """

    a: Any = 0.0
    alpha: Any = 0.0
    d: Any = 0.0
    theta: Any = 0.0
    slides: bool = False
    name: str = ""
    masses: tuple[Mass, ...] = ()

    def __post_init__(self) -> None:
        for key, unit in _UNITS.items():
            words = f"a finite {'length' if unit == 'm' else 'angle'} [{unit}]"
            value, subject = getattr(self, key), f"{key} of a row of Denavit and Hartenberg"
            if not is_formula(value):
                object.__setattr__(self, key, as_float(subject, value, words, unit))
            elif not is_possible(value):
                raise InputError(subject, got=value, expected=words)

    @property
    def about_x(self) -> Frame:
        """``Tx(a) Rx(alpha)``, which commute."""
        cosine, sine = _cosine_and_sine(self.alpha)
        return _frame([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]], [self.a, 0, 0])

    @property
    def about_z(self) -> Frame:
        """``Rz(theta) Tz(d)``, which commute, without the coordinate of the joint."""
        cosine, sine = _cosine_and_sine(self.theta)
        return _frame([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]], [0, 0, self.d])


def serial_arm(
    dh: Sequence[DHRow],
    *,
    convention: DHConvention,
    joint_stiffness: Any,
    limits: Sequence[tuple[float, float] | None] | None = None,
    home: Sequence[Scalar | None] | None = None,
    tool: Frame | RigidTransform | None = None,
    base: Frame | RigidTransform | None = None,
    name: str = "arm",
    coordinates: Sequence[Coordinate] = (),
    title: str = "",
    source: str = "",
) -> Robot:
    """A serial arm of a table of Denavit and Hartenberg, with elastic drives and rigid links.

    The pose of the tool is ``base T_1 T_2 ... T_n tool``, where ``T_i`` is the product that the
    convention names, and the coordinate of the joint is added to its ``theta``, or to its ``d``
    when it slides. For elastic links write the leg element by element instead.

    Parameters
    ----------
    dh : sequence of DHRow
        One row a joint, from base to tool.
    convention : DHConvention
        Standard and modified tables of the same arm differ; the source says which one it is.
    joint_stiffness : float, formula or None, or a sequence of these
        Of the drives [N m/rad, N/m where a joint slides]; one for all, or one a joint. None for a
        rigid one.
    limits : sequence of (float, float) or None, optional
        Lowest and highest coordinate of each joint [rad, m].
    home : sequence of float or formula, optional
        Coordinates of the home configuration [rad, m]; zeros when left out.
    tool : Frame or RigidTransform, optional
        The tool in the frame of the last row; stiffness is given about its origin.
    base : Frame or RigidTransform, optional
        The frame of the first row in the world.
    name, title, source : str
    coordinates : sequence of Coordinate
        Those in which a pose of the tool may be given; none for an arm that is posed by its joints.

    Raises
    ------
    InputError
        For rows of another kind, lists of other lengths, or an arm that is rigid as a whole.

    Examples
    --------
    >>> import numpy as np
    >>> rows = [DHRow(d=0.4, alpha=-np.pi / 2), DHRow(a=0.5), DHRow(a=0.4)]
    >>> arm = serial_arm(rows, convention=DHConvention.STANDARD, joint_stiffness=[2e4, 2e4, 1e4])
    >>> arm
    <Robot 'arm', 1 leg, posed by its joints>
    >>> arm.legs[0].chain.coordinate_names
    ('joint1', 'joint2', 'joint3')
    >>> arm.legs[0].chain.elements[1].transform.p
    array([0. , 0. , 0.4])
    """
    rows = _checked_rows(dh)
    is_modified = DHConvention(convention) is DHConvention.MODIFIED
    # The fixed part before the first joint, and those after each joint.
    first, links = Frame.identity(), [row.about_z @ row.about_x for row in rows]
    if is_modified:
        after = [row.about_x for row in rows[1:]] + [Frame.identity()]
        first, links = rows[0].about_x, [r.about_z @ x for r, x in zip(rows, after, strict=True)]
    per_joint = zip(
        *(rows, links, _one_a_joint("joint_stiffness", joint_stiffness, len(rows))),
        *(_one_a_joint("limits", limits, len(rows)), _one_a_joint("home", home, len(rows))),
        strict=True,
    )
    elements: list[Element] = []
    for number, (row, link, stiffness, bound, q_home) in enumerate(per_joint, start=1):
        make = prismatic if row.slides else revolute
        q, name_of_joint = () if q_home is None else (q_home,), row.name or f"joint{number}"
        frame = row.about_z if is_modified else link
        masses = tuple(m if m.centre is None else m.seen_from(frame) for m in row.masses)
        elements.append(make(_AXIS, Actuated(stiffness, bound), home=q, name=name_of_joint))
        elements.append(Rigid(link, f"link{number}", masses))
    if tool is not None:
        elements.append(Rigid(Frame.of(tool), "tool"))
    start = (Frame.identity() if base is None else Frame.of(base)) @ first
    leg = Leg("arm", start, Chain(tuple(elements)), Frame.identity())
    return Robot(name, (leg,), coordinates=tuple(coordinates), title=title, source=source)


def _checked_rows(dh: Sequence[DHRow]) -> list[DHRow]:
    rows = list(dh)
    for i, row in enumerate(rows):
        if not isinstance(row, DHRow):
            raise InputError(
                f"table of Denavit and Hartenberg, row [{i}]",
                got=row,
                expected="a DHRow",
                hint="write DHRow(a=..., alpha=..., d=..., theta=...) by name: books differ in the "
                "order of the four",
            )
    if not rows:
        subject = "table of Denavit and Hartenberg"
        raise InputError(subject, got=Words("no row"), expected="a row a joint")
    names = [row.name or f"joint{number}" for number, row in enumerate(rows, start=1)]
    check_distinct("names of the joints", names)
    if not any(is_formula(getattr(row, key)) for row in rows for key in _UNITS):
        return rows
    # Angles of numbers beside formulas become exact.
    return [replace(row, alpha=_exact(row.alpha), theta=_exact(row.theta)) for row in rows]


def _exact(angle: Any) -> Any:
    import sympy as sp

    quarters = None if is_formula(angle) else _quarter_turns(angle)
    return exact_number(angle) if quarters is None else quarters * sp.pi / 2


def _one_a_joint(subject: str, value: Any, count: int) -> Iterator[Any]:
    values = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(values, list | tuple):
        return iter([values] * count)
    if len(values) != count:
        raise InputError(
            subject,
            got=Words(f"{len(values)} for {count} joints"),
            expected="one for each row of the table",
            hint="write None for a joint without",
        )
    return iter(values)


def _cosine_and_sine(angle: Any) -> tuple[Any, Any]:
    """Exact at quarter turns, so that an axis that is meant to be square is."""
    if is_formula(angle):
        import sympy as sp

        return sp.cos(angle), sp.sin(angle)
    quarters = _quarter_turns(angle)
    if quarters is None:
        return np.cos(angle), np.sin(angle)
    return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[quarters % 4]


def _quarter_turns(angle: float) -> int | None:
    """How many quarter turns an angle is, up to rounding; None for any other angle."""
    quarters = round(angle / (np.pi / 2))
    rest = abs(angle - quarters * (np.pi / 2))
    return quarters if rest <= _ROUNDINGS * np.spacing(abs(angle)) else None


def _frame(R: list[list[Any]], p: list[Any]) -> Frame:
    arrays = [np.array(entries, dtype=object) for entries in (R, p)]
    return Frame(
        *(exact_array(x) if any(map(is_formula, x.flat)) else x.astype(float) for x in arrays)
    )
