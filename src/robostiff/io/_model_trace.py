"""Following an error of pydantic from the top of a file model down to the place it speaks of."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, RootModel, Tag
from pydantic.fields import FieldInfo

Step = str | int


@dataclass(frozen=True)
class Trace:
    """Where an error is, and what was allowed there.

    Attributes
    ----------
    path : tuple of str and int
        In the document: without the labels by which pydantic tells the members of a union apart.
    annotation : Any
        Type of what should be there; ``Any`` where it is not known.
    metadata : tuple
        Bounds and the like on the type.
    container : Any
        Type of what has the last step as a key or position.
    """

    path: tuple[Step, ...]
    annotation: Any
    metadata: tuple[Any, ...]
    container: Any

    @property
    def model(self) -> type[BaseModel] | None:
        """The model that has the last step as a key."""
        return self.container if is_model(self.container) else None


def trace(model: type[BaseModel], data: Any, steps: Sequence[Step]) -> Trace:
    """Follow the ``loc`` of an error through the model, and through the data where it says nothing.

    Examples
    --------
    >>> class Beam(BaseModel):
    ...     type: Literal["beam"]
    >>> class Robot(BaseModel):
    ...     parts: list[Beam | float]
    >>> trace(Robot, {"parts": [{"type": 3}]}, ("parts", 0, "Beam", "type")).path
    ('parts', 0, 'type')
    """
    annotation, metadata = plain(model)
    container: Any = None
    path: list[Step] = []
    for step in steps:
        if is_union(annotation):
            annotation, metadata = _member(annotation, step)
            continue
        known, child = _child(annotation, step)
        if not known and not _has(data, step):
            continue  # the label of some validator
        path.append(step)
        container = annotation
        data = data[step] if _has(data, step) else None
        annotation, metadata = child
    return Trace(tuple(path), annotation, metadata, container)


def plain(annotation: Any, metadata: tuple[Any, ...] = ()) -> tuple[Any, tuple[Any, ...]]:
    """A type without Annotated, alias, ``| None`` and root model around it; and its metadata."""
    while True:
        if get_origin(annotation) is Annotated:
            annotation, *more = get_args(annotation)
            metadata = (*_spread(more), *metadata)
        elif hasattr(annotation, "__value__"):  # a type alias
            annotation = annotation.__value__
        elif isinstance(annotation, type) and issubclass(annotation, RootModel):
            annotation = annotation.model_fields["root"].annotation
        elif is_union(annotation) and len(members(annotation)) == 1:
            (annotation,) = members(annotation)
        else:
            return annotation, metadata


def _spread(metadata: Sequence[Any]) -> Iterator[Any]:
    """The metadata, with what a ``Field(...)`` holds in place of it."""
    for item in metadata:
        yield from item.metadata if isinstance(item, FieldInfo) else (item,)


def is_union(annotation: Any) -> bool:
    """Whether a type is ``A | B``."""
    return get_origin(annotation) in (Union, UnionType)


def is_model(annotation: Any) -> bool:
    """Whether a type is a mapping with known keys."""
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def members(annotation: Any) -> tuple[Any, ...]:
    """The members of a union, None aside."""
    return tuple(member for member in get_args(annotation) if member is not NoneType)


def keys(model: type[BaseModel]) -> list[str]:
    """The keys that a model allows, as a file writes them; the required ones first."""
    fields = sorted(model.model_fields.items(), key=lambda item: not item[1].is_required())
    return [field.alias or name for name, field in fields]


def tags(annotation: Any, discriminator: str | None = None) -> Iterator[str]:
    """The words that tell the members of a union apart."""
    for member in members(annotation) if is_union(annotation) else (annotation,):
        kind, metadata = plain(member)
        yield from (str(item.tag) for item in metadata if isinstance(item, Tag))
        if is_union(kind):
            yield from tags(kind, discriminator)
        elif is_model(kind):
            for name, field in kind.model_fields.items():
                literal = get_origin(field.annotation) is Literal
                if literal and discriminator in (None, name, field.alias):
                    yield from (str(word) for word in get_args(field.annotation))


def _member(annotation: Any, label: Step) -> tuple[Any, tuple[Any, ...]]:
    """The member of a union that a label names; ``Any`` if it names none."""
    for member in members(annotation):
        kind, metadata = plain(member)
        own = [str(item.tag) for item in metadata if isinstance(item, Tag)]
        if label in own or label == getattr(kind, "__name__", None):
            return kind, metadata
        if label in list(tags(member)):
            return _member(kind, label) if is_union(kind) else (kind, metadata)
    for member in members(annotation):
        kind, metadata = plain(member)
        origin = getattr(get_origin(kind), "__name__", None)
        if is_union(kind) or (origin and str(label).startswith(f"{origin}[")):
            return kind, metadata
    return Any, ()


def _child(annotation: Any, step: Step) -> tuple[bool, tuple[Any, tuple[Any, ...]]]:
    """Whether a type says what is at a step; the type that is there."""
    unknown = (Any, ())
    if is_model(annotation):
        for name, field in annotation.model_fields.items():
            if step in (name, field.alias):
                return True, plain(field.annotation, tuple(field.metadata))
        return True, unknown
    origin, arguments = get_origin(annotation), get_args(annotation)
    if not isinstance(origin, type) or not arguments:
        return False, unknown
    if issubclass(origin, Mapping):
        return step != "[key]", plain(arguments[-1])
    if issubclass(origin, Sequence) and isinstance(step, int):
        many = origin is not tuple or arguments[-1] is Ellipsis
        kind = arguments[0] if many else arguments[min(step, len(arguments) - 1)]
        return True, plain(kind)
    return False, unknown


def _has(data: Any, step: Step) -> bool:
    if isinstance(data, dict):
        return step in data
    return isinstance(data, list) and isinstance(step, int) and 0 <= step < len(data)
