"""Frozen data against the standard decorator, which it stands for."""

import dataclasses
import inspect
import pickle
from functools import cached_property
from typing import Any, ClassVar

import pytest

from robostiff.frozen import field, frozen, replace


class Plain:
    """Fields of all kinds."""

    length: float
    name: str = "beam"
    ends: list[int] = field(default_factory=lambda: [1, 2], repr=False)
    note: str = field(default="", compare=False)
    kind: ClassVar[str] = "elastic"
    _: dataclasses.KW_ONLY
    unit: str = "m"
    made: list[int] = field(default_factory=list, init=False)
    seen: int = field(default=0, init=False)

    def __post_init__(self):
        object.__setattr__(self, "length", float(self.length))

    @cached_property
    def double(self):
        return 2 * self.length


class Own:
    """Methods of its own stay."""

    values: list[int]

    def __init__(self, *values):
        object.__setattr__(self, "values", list(values))

    def __repr__(self):
        return "own"

    def __eq__(self, other):
        return isinstance(other, Own) and sorted(self.values) == sorted(other.values)

    def __hash__(self):
        return len(self.values)


def both(cls, **options):
    """The class by the standard decorator and by ours."""
    body = {name: x for name, x in vars(cls).items() if name not in {"__dict__", "__weakref__"}}
    one, other = (type(cls.__name__, (), dict(body)) for _ in range(2))
    return dataclasses.dataclass(frozen=True, **options)(one), frozen(**options)(other)


@pytest.mark.parametrize("options", [{}, {"kw_only": True}, {"eq": False}, {"repr": False}])
def test_objects_are_as_those_of_the_standard_decorator(options):
    made = both(Plain, **options)
    signatures = {str(inspect.signature(cls)) for cls in made}
    assert len(signatures) == 1
    assert made[0].__match_args__ == made[1].__match_args__

    def answers(cls):
        a, b = cls(length=3, unit="mm"), cls(length=3, unit="mm", note="left")
        yield [vars(x) for x in (a, b)]
        yield [cls.__doc__, a.double, a == b, a == replace(a, name="strut"), a.__eq__(3)]
        yield [repr(a) if options.get("repr", True) else "", dataclasses.asdict(b)]
        yield a.ends is b.ends
        for change in (lambda: setattr(a, "x", 1), lambda: delattr(a, "name"), cls):
            with pytest.raises((AttributeError, TypeError)) as met:
                change()
            yield type(met.value), str(met.value)
        if options.get("eq", True):
            with pytest.raises(TypeError, match="unhashable"):
                hash(a)
        yield len({type(hash(x)) for x in (a, b) if not options.get("eq", True)})

    assert list(answers(made[0])) == list(answers(made[1]))


def test_methods_of_the_class_stay():
    for cls in both(Own):
        assert (repr(cls(2, 1)), len({cls(2, 1), cls(1, 1)})) == ("own", 2)
        assert cls(2, 1).values == [2, 1]


@frozen
class Part:
    """A base."""

    name: str


@frozen
class Spring(Part):
    """With one field more, and equal only to its own kind."""

    stiffness: float = 1.0


class Loose(Spring):
    """Not decorated: other attributes may be set."""


def test_classes_inherit_fields_and_are_pickled():
    spring = Spring("s", 2.0)
    assert pickle.loads(pickle.dumps(spring)) == spring != Part("s")  # noqa: S301
    assert hash(spring) == hash(("s", 2.0))
    assert len({spring, Spring("s", 2.0)}) == 1
    loose: Any = Loose("s")
    loose.colour = "red"
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'name'"):
        loose.name = "t"
    match spring:
        case Spring(name, k):
            assert (name, k) == ("s", 2.0)


@frozen(init=False)
class Sorted(Own):
    """Made as its base is."""


def test_a_class_may_be_made_as_its_base():
    assert Sorted(2, 1).values == [2, 1]
