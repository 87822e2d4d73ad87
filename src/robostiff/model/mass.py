"""Masses of the parts of a robot, also in the world, and the gravity that pulls at them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from robostiff.elasticity.checks import Bounds
from robostiff.errors import InputError, Words
from robostiff.frozen import frozen, replace
from robostiff.model.batched import BatchedPart
from robostiff.model.checks import vector3
from robostiff.record import Entry, is_zero, usual_size
from robostiff.spatial import Frame, as_float, as_floats
from robostiff.spatial.formula import formula_array, is_formula, is_possible

STANDARD_GRAVITY = 9.80665
"""Acceleration of free fall [m/s^2], ISO 80000-3."""

_ZERO_OR_MORE = "zero or more [kg]"
# Of the largest moment: what rounding leaves of a plate or a rod.
_FLAT = 1e-9
_AXES = {"x": 0, "y": 1, "z": 2}
_GRAVITY = "three numbers [m/s^2], or the axis along which it points, such as -z"


@frozen
class Mass:
    """A mass that a part of a robot carries.

    Attributes
    ----------
    value : float or formula
        Zero or more [kg].
    centre : (3,) array or None
        Where it is in its body [m]: in the frame in which its part begins, of a joint in that
        behind it; in the platform frame for a mass on the platform; in world axes from the point of
        a node. None for the middle between the ends of the part, or the origin of the platform
        frame; of one that is given beside those of the robot, for the place of its part, or the
        reference point.
    span : (float, float) or None
        Of a mass that is spread evenly along an elastic part: from which to which part of its
        length. An elastic part without a `centre` or `inertia` has it spread along all of it.
    name : str
        What it is, such as ``tool``.
    inertia : (3,) or (3, 3) array or None
        Moments of inertia about the centre, in the axes in which the centre is given [kg m^2]; None
        for a mass in one point. It matters for `modes` alone.
    point : (3,) array or None
        In place of a centre, of a mass that is given beside those of the robot: where it is in the
        world at the unloaded posture [m]. Its inertia is in world axes, too.

    Raises
    ------
    InputError
        When the mass is negative, two of centre, span and point are given, or the inertia is that
        of no body.

    Examples
    --------
    >>> Mass(3.5, [0, 0, 0.05], name="spindle").value
    3.5
    >>> Mass(150, inertia=[4, 4, 7]).inertia[2, 2]
    np.float64(7.0)
    """

    value: Any
    centre: Any = None
    span: tuple[Any, Any] | None = None
    name: str = "mass"
    inertia: Any = None
    point: Any = None

    def __post_init__(self) -> None:
        subject = "mass" if self.name == "mass" else f"mass of {self.name!r}"
        object.__setattr__(self, "value", mass_value(subject, self.value))
        if self.inertia is not None:
            object.__setattr__(self, "inertia", _inertia(subject, self.inertia))
            if self.span is not None or self.value == 0:
                raise InputError(
                    f"inertia of {subject}",
                    got="no mass" if self.value == 0 else "a span beside it",
                    expected="a mass of more than zero [kg] in one place",
                )
        places = [key for key in ("centre", "span", "point") if getattr(self, key) is not None]
        if len(places) > 1:
            raise InputError(subject, got=f"a {' and a '.join(places)}", expected="one of them")
        for key in ("centre", "point"):
            if key in places:
                place = vector3(f"{key} of {subject}", getattr(self, key))
                object.__setattr__(self, key, place)

    @property
    def bounds(self) -> tuple[Bounds, ...]:
        """Inequalities without which it does not exist."""
        return (Bounds("mass", self.value, expected=_ZERO_OR_MORE, or_at=True),)

    @classmethod
    def of(cls, value: Any) -> Mass:
        """The mass itself, or that of a number [kg]."""
        return value if isinstance(value, Mass) else cls(value)

    @property
    def is_spread(self) -> bool:
        """Whether an elastic part has it spread along its length."""
        return self.centre is None and self.inertia is None

    def seen_from(self, frame: Frame) -> Mass:
        """The same mass, its centre given, in the frame from which its own is seen as `frame`."""
        inertia = None if self.inertia is None else frame.R @ self.inertia @ frame.R.T
        centre = frame.p if self.centre is None else frame.p + frame.R @ self.centre
        return replace(self, centre=centre, inertia=inertia)

    def placed(
        self,
        name: str,
        R: np.ndarray,
        p: np.ndarray,
        after: int = 0,
        start: np.ndarray | None = None,
    ) -> tuple[PlacedMass, ...]:
        """In the world, where its frame has axes R and origin p: one mass, with an inertia six."""
        c = np.zeros(3) if self.centre is None else self.centre
        places = ((value, p + np.einsum("...ij,j->...i", R, c + arm)) for value, arm in self.points)
        return tuple(PlacedMass(name, np.asarray(x), at, after, start) for x, at in places)

    @property
    def points(self) -> tuple[tuple[Any, np.ndarray], ...]:
        """Masses [kg] at places from its centre (3,) [m], which have its inertia together.

        With principal moments ``I_i`` the second moments are ``P_i = (I_1 + I_2 + I_3)/2 - I_i``; a
        sixth of the mass at ``+-sqrt(3 P_i / m)`` along each principal axis has them.

        Examples
        --------
        >>> [(value, place.tolist()) for value, place in Mass(6, inertia=[4, 4, 4]).points][0]
        (1.0, [1.0, 0.0, 0.0])
        """
        if self.inertia is None:
            return ((self.value, np.zeros(3)),)
        moments, axes = np.linalg.eigh(self.inertia)
        second = np.maximum(0.5 * np.sum(moments) - moments, 0.0)
        arms = axes.T * np.sqrt(3.0 * second / self.value)[:, None]
        return tuple((self.value / 6.0, arm) for arm in (*arms, *-arms))


def _inertia(subject: str, value: Any) -> np.ndarray:
    """Moments of inertia (3, 3) of a body [kg m^2]."""
    expected = "three moments, or a symmetric (3, 3) array [kg m^2]"
    inertia = as_floats(f"inertia of {subject}", value, expected, "kg m^2")
    if inertia.shape == (3,):
        inertia = np.diag(inertia)
    size = np.max(np.abs(inertia), initial=0.0)
    if inertia.shape != (3, 3) or np.max(np.abs(inertia - inertia.T)) > _FLAT * size:
        raise InputError(f"inertia of {subject}", got=value, expected=expected)
    moments = np.linalg.eigvalsh(inertia)
    if np.min(0.5 * np.sum(moments) - moments) < -_FLAT * size:
        raise InputError(
            f"inertia of {subject}",
            got=inertia.tolist(),
            expected="moments of which none is more than the other two together [kg m^2]",
        )
    return 0.5 * (inertia + inertia.T)


def mass_value(subject: str, value: Any) -> Any:
    """A mass [kg]: zero or a positive number, or a formula."""
    if not is_formula(value):
        number = as_float(subject, value, _ZERO_OR_MORE, "kg")
        if number >= 0:
            return number
    elif is_possible(value) and getattr(value, "is_negative", None) is not True:
        return value
    raise InputError(subject, got=value, expected=_ZERO_OR_MORE)


def masses_of(value: Any) -> tuple[Mass, ...]:
    """Masses of a part of a robot: none, a number [kg], a mass or several of them.

    Raises
    ------
    InputError
        When one is given in the world, which it leaves as the robot moves.
    """
    several = value if isinstance(value, list | tuple) else () if value is None else (value,)
    masses = tuple(Mass.of(x) for x in several)
    for mass in masses:
        if mass.point is not None:
            raise InputError(
                f"mass {mass.name!r} of a part",
                got=Words(f"a point in the world, {mass.point.tolist()}"),
                expected="its centre in the frame in which the part begins [m]",
                hint="write Mass(2, centre=[0, 0, 0.1])",
            )
    return masses


def gravity_vector(subject: str, value: Any) -> np.ndarray:
    """Acceleration of free fall in the world (3,) [m/s^2], from numbers or the name of an axis.

    Raises
    ------
    InputError
        When it is neither.

    Examples
    --------
    >>> gravity_vector("gravity", "-z")
    array([ 0.     ,  0.     , -9.80665])
    """
    if isinstance(value, str):
        axis = _AXES.get(value.strip().lstrip("+-"))
        if axis is None:
            raise InputError(subject, got=value, expected=_GRAVITY)
        vector = np.zeros(3)
        vector[axis] = -STANDARD_GRAVITY if value.strip().startswith("-") else STANDARD_GRAVITY
        return vector
    if formula_array(value) is not None:
        return vector3(subject, value)
    vector = as_floats(subject, value, _GRAVITY, "m/s^2")
    if vector.shape != (3,):
        raise InputError(subject, got=value, expected=_GRAVITY, hint='write gravity="-z"')
    return vector


_SAME = 1e-12  # of a part of a length: rounding at the samples


@frozen
class PointMass:
    """A mass at a point of a body."""

    after: int  # how many elements of the part lie before the body
    value: Any  # [kg]
    point: np.ndarray  # (3,): at the unloaded posture [m]


@frozen
class PlacedMass(BatchedPart):
    """A mass in the world."""

    name: str  #: of its part
    value: np.ndarray  #: (...) [kg]
    centre: np.ndarray  #: (..., 3): where it is [m]
    #: how many elements of its leg lie before the body that carries it; 0 in a network. It is
    #: spread along, or carried by, the last of these where `start` is given
    after: int = 0
    start: np.ndarray | None = None  #: (..., 3): where the elastic part that carries it begins [m]
    #: from which to which part of its length it is spread; None for a mass in one place
    span: tuple[float, float] | None = None

    def end_of_part(self, point: Any) -> Any:
        """Where its part ends (..., 3) [m]: if it is spread by its own places, or at a point."""
        if self.start is None or self.span is None:
            return np.asarray(point)
        return self.start + (self.centre - self.start) * (2.0 / sum(self.span))

    def lumped(self, cuts: Sequence[float], end: np.ndarray) -> list[PointMass]:
        """The mass as points on bodies whose weights bend its elastic part as it does.

        A clamped cubic of length L moves across at s L by ``(3 s^2 - 2 s^3) v + (s^3 - s^2) L r``,
        v and r of its far end. The weight of what lies there acts on the far body by a share
        ``3 s^2 - 2 s^3`` at the distance ``L (s^2 - s^3) / (3 s^2 - 2 s^3)`` before its end, and
        alike on the near body; of a mass that is spread both are integrals. Spread evenly, half of
        it is L/6 before each end. A uniform beam has then the deflection under its weight exactly
        at its tip.

        Parameters
        ----------
        cuts : sequence of float
            Where elements of the elastic part begin and end, as parts of its length, 0 and 1 among
            them; none for a mass in one place of a body.
        end : (3,) array
            Where the elastic part ends [m], of numbers or of entries of a record, as the mass.

        Examples
        --------
        >>> middle, start = np.array([0.3, 0, 0]), np.zeros(3)
        >>> beam = PlacedMass("beam", np.array(3.0), middle, start=start, span=(0.0, 1.0))
        >>> [(own.value, round(own.point[0], 9)) for own in beam.lumped((0, 1), 2 * middle)]
        [(1.5, np.float64(0.1)), (1.5, np.float64(0.5))]
        """
        value = np.asarray(self.value).item()
        if self.start is None or not cuts:
            return [PointMass(0, value, np.asarray(self.centre))]
        x = end - self.start
        if self.span is None:
            length, first = x @ x, 1.0  # which part of its length it is at
            if usual_size(length):
                first = (self.centre - self.start) @ x / length
                if not isinstance(first, Entry):
                    first = float(np.clip(first, 0.0, 1.0))
                elif np.max(np.abs(first.sample - usual_size(first))) < _SAME:
                    first = usual_size(first)  # a number at all samples
            last, aside = first, self.centre - self.start - x * first
        else:
            (first, last), aside = self.span, np.zeros(3)
        in_one_place = is_zero(last - first)
        points = []
        at = self.start + aside
        inner = [usual_size(first) >= cut for cut in cuts[1:-1]]
        for i, (near, far) in enumerate(pairwise(cuts)):
            low, high = ((s - near) * (1 / (far - near)) for s in (first, last))
            if in_one_place:
                lump = value if sum(inner) == i else 0
            else:
                low, high = max(low, 0.0), min(high, 1.0)
                lump = value * (max(high - low, 0.0) * (far - near) / (last - first))
            if usual_size(lump) == 0:
                continue
            (after, arm), (before, near_arm) = _share(low, high), _share(1 - high, 1 - low)
            for body, share, place in ((i, before, near_arm), (i + 1, after, 1 - arm)):
                if usual_size(share) > 0:
                    s = near + place * (far - near)
                    points.append(PointMass(body, lump * share, at + x * s))
        return points


def _share(low: Any, high: Any) -> tuple[Any, Any]:
    """Share of the far end in what lies between two places, and how far before it that acts."""
    if is_zero(high - low):
        square = low * low
        share, moment = 3 * square - 2 * square * low, square - square * low
    else:
        share = _mean(low, high, lambda s: s**3 - s**4 / 2)
        moment = _mean(low, high, lambda s: s**3 / 3 - s**4 / 4)
    return share, moment / share if usual_size(share) > 0 else 0.0


def _mean(low: float, high: float, integral: Callable[[float], float]) -> float:
    return (integral(high) - integral(low)) / (high - low)
