"""Commands and their options, declared once with their words.

A command is a class whose fields are its options; those that several commands have are groups.
Nothing here computes.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, Field, fields
from typing import TYPE_CHECKING, Any, ClassVar, dataclass_transform

import click

from robostiff.errors import InputError
from robostiff.frozen import field, frozen

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

_STATUS = "Exit status: 0 for an answer, 1 for an answer with a bad status, 2 for bad input."
_POSE = '"x y z rx ry rz"'
_WRENCH = '"fx fy fz mx my mz"'
_JOINTS = '"q1 q2 ..."'


def option(*names: str, default: Any = None, **words: Any) -> Any:
    """A field of a class that is an option.

    One without ``metavar`` is a flag. Without a default (``...``) it must be given.
    """
    if "metavar" not in words:
        words["is_flag"], default = True, False
    if words.get("metavar") in {"FILE", "FILE.csv"}:
        words["shell_complete"] = _files
    if default is ...:
        return field(metadata={"names": names, "words": {**words, "required": True}})
    return field(default=default, metadata={"names": names, "words": words})


def repeatable(name: str, metavar: str, text: str) -> Any:
    """An option that may be given several times: a tuple."""
    words = {"metavar": metavar, "multiple": True, "help": f"{text}; repeatable."}
    return option(name, default=(), **words)


def argument(metavar: str, text: str, default: Any = ..., **words: Any) -> Any:
    """A field of a class that is given without a name."""
    metadata = {"words": {"metavar": metavar, **words}, "text": text}
    return field(metadata=metadata) if default is ... else field(default=default, metadata=metadata)


def group(of: type, *names: str) -> Any:
    """A field that is an object of a class of options, or of some of them by their names."""
    return field(metadata={"group": of, "names_of_group": names or None})


def _fields(of: type, names: Sequence[str] | None = None) -> Iterator[Field[Any]]:
    """The options of a class, those of its groups in their places."""
    for entry in fields(of):
        if "group" in entry.metadata:
            yield from _fields(entry.metadata["group"], entry.metadata["names_of_group"])
        elif names is None or entry.name in names:
            yield entry


class ExplainedArgument(click.Argument):
    """What is given without a name, with words for help."""

    def __init__(self, *names: Any, text: str, **words: Any) -> None:
        super().__init__(*names, **words)
        self.text = text


def build(of: type, arguments: Mapping[str, Any], names: Sequence[str] | None = None) -> Any:
    """The object of a class, of what the command line has for its fields."""
    values = {}
    for entry in fields(of):
        if "group" in entry.metadata:
            inner = entry.metadata["group"], arguments, entry.metadata["names_of_group"]
            values[entry.name] = build(*inner)
        elif names is None or entry.name in names:
            values[entry.name] = arguments[entry.name]
    return of(**values)


@dataclass_transform(
    frozen_default=True,
    kw_only_default=True,
    field_specifiers=(option, repeatable, argument, group),
)
class Command:
    """A command: its options are its fields, and its docstring is its help.

    Lines there that begin with ``$`` are examples. `run` imports what computes, so that help is
    fast.
    """

    named: ClassVar[dict[str, type[Command]]] = {}

    def __init_subclass__(cls, name: str) -> None:
        Command.named[name] = frozen(kw_only=True)(cls)

    def run(self) -> int:
        """Do what is asked for; the exit status."""
        raise NotImplementedError

    @classmethod
    def words(cls) -> tuple[str, ...]:
        """Paragraphs of its help: what it does, examples, and what its exit status means."""
        paragraphs = inspect.cleandoc(cls.__doc__ or "").split("\n\n")
        for i, text in enumerate(paragraphs):
            lines = [line.strip() for line in text.replace("\n  ", " ").split("\n")]
            if lines[0].startswith("$ "):
                head = "Example:" if len(lines) == 1 else "Examples:"
                shown = (f"  robostiff {line.removeprefix('$ ')}" for line in lines)
                paragraphs[i] = "\n".join(["\b", head, *shown])
        if "Exit status" not in paragraphs[-1]:
            paragraphs.append(_STATUS)
        return tuple(paragraphs)

    @classmethod
    def parameters(cls) -> list[click.Parameter]:
        """Its fields, as the parser has them."""
        parameters: list[click.Parameter] = []
        for entry in _fields(cls):
            words = dict(entry.metadata["words"])
            if entry.default is not MISSING and not words.get("multiple"):
                words["default"] = entry.default
            if "names" in entry.metadata:
                parameters.append(click.Option([*entry.metadata["names"], entry.name], **words))
            else:
                words |= {"text": entry.metadata["text"], "required": entry.default is MISSING}
                parameters.append(ExplainedArgument([entry.name], **words))
        return parameters


def _files(*_: Any) -> list[CompletionItem]:
    from click.shell_completion import CompletionItem  # of no use to a command that runs

    return [CompletionItem("", type="file")]


def robot_names(_context: Any, _parameter: Any, incomplete: str) -> list[CompletionItem]:
    """Shipped robots whose names begin so; the shell itself completes files."""
    from click.shell_completion import CompletionItem

    from robostiff.robots import shipped_names

    names = sorted(name for name in shipped_names() if name.startswith(incomplete))
    return [*_files(), *map(CompletionItem, names)]


def robot_argument(metavar: str = "ROBOT", more: str = "") -> Any:
    """The robot of a command, first of its arguments."""
    return argument(
        metavar,
        "A shipped robot (see 'robostiff robots'), a model file, a snapshot or network file, a "
        f"robot description (URDF, xacro, MJCF){more}, or - for standard input.",
        shell_complete=robot_names,
    )


def wrench_option(text: str, *, name: str = "--wrench") -> Any:
    """Force and moment on the platform."""
    words = f"{text} [N, N m]; or some by name, 'Fz=-500 N, Mx=3 N m'."
    return option(name, metavar=_WRENCH, help=words)


def gravity_option() -> Any:
    """Free fall, for loads of masses."""
    return option(
        "--gravity",
        metavar='"gx gy gz"',
        help="Acceleration of free fall [m/s^2], or an axis along which it is, such as -z; '0 0 0' "
        "for none. By default that of the model file; for a deflection none.",
    )


def output_option(text: str, default: Any = ...) -> Any:
    """A file to be written."""
    return option("-o", "--output", metavar="FILE", default=default, help=text)


def plot_option(text: str, endings: str = ".png, .svg, .pdf or .html") -> Any:
    """A picture beside the answer."""
    return option("--plot", metavar="FILE", help=f"{text} into a new file: {endings}.")


@frozen
class Model:
    """A robot, as it is written: its file, other values of parameters, its side file."""

    source: str = robot_argument()
    side: str | None = option(
        "--side",
        metavar="FILE",
        help="Stiffnesses, passive joints and loops of a robot description (URDF, xacro, MJCF). "
        "By default NAME.stiffness.yaml beside it.",
    )
    allow_xacro: bool = option(
        "--allow-xacro",
        help="Expand a xacro that is named in a side file, which runs the Python written in it.",
    )
    settings: tuple[str, ...] = repeatable(
        "--set",
        "NAME=VALUE",
        "Give a parameter of the model file another value, such as --set R=350mm",
    )

    @property
    def parameters(self) -> dict[str, str]:
        """Parameters of the model file."""
        return named_once("--set", self.settings, "NAME=VALUE, such as R=350mm")

    @property
    def files(self) -> dict[str, Any]:
        """Its side file, as `robostiff.load` takes it."""
        return {"side": self.side, "allow_xacro": self.allow_xacro}

    def load(self, moved: Mapping[str, str] | None = None, **options: Any) -> Any:
        """The robot; `moved` are further parameters."""
        from robostiff.robots import load

        return load(self.source, {**self.parameters, **(moved or {})}, **self.files, **options)


@frozen
class Posing:
    """Pose, posture and reference point, as they are written."""

    pose: str | None = option(
        "--pose",
        metavar=_POSE,
        help="Platform pose: point [m] and rotation vector [rad], units may be written ('10 mm 0 "
        "0.5 0 0 10 deg'); or the robot's free coordinates alone, or some by name, 'z=0.5, rx=10 "
        "deg', others as at home; or tip and axis of the tool, 'tip 0.1 0 0.5 axis 0 0.1 1'. Home "
        "when left out.",
    )
    joints: str | None = option(
        "--joints",
        metavar=_JOINTS,
        help="Joint coordinates of a serial arm, or those of the actuators of any other robot "
        "[m, rad], in place of --pose; or some by name, 'leg1/slide=20 mm'.",
    )
    near: str | None = option(
        "--near",
        metavar=_JOINTS,
        help="Joint coordinates of all legs, one after the other [m, rad]: the nearest posture is "
        "taken. By default that of home.",
    )
    at: str | None = option(
        "--at",
        metavar='"x y z"',
        help="Point of the platform, in world coordinates, about which the answer is given [m].",
    )


@frozen
class Answer:
    """Whether an answer replaces files, and how it is printed."""

    overwrite: bool = option("--overwrite", help="Replace a file that is there already.")
    as_json: bool = option("--json", help="Print one JSON object.")


def length_option() -> Any:
    """The length of the indices that need one."""
    return option(
        "--length",
        metavar="LENGTH",
        help="Characteristic length of the indices that need one [m]; by default that of the robot "
        "at the pose, in a map at home.",
    )


@frozen
class Loads:
    """Loads on bodies, as they are written."""

    wrench: str | None = wrench_option(
        "Force and moment on the platform about the point --at, which moves along"
    )
    weights: tuple[str, ...] = repeatable(
        "--weight",
        '"LEG/PART=MASS"',
        "A mass [kg] on the body behind a part, or on 'platform'; its weight acts along --gravity, "
        "or along -z (planar robots: -y) where there is none",
    )
    forces: tuple[str, ...] = repeatable(
        "--load", '"LEG/PART=fx fy fz"', "A force [N] on the body behind a part, or on 'platform'"
    )
    gravity: str | None = gravity_option()
    preloads: tuple[str, ...] = repeatable(
        "--preload",
        '"LEG/PART=FORCE"',
        "With how much a drive pushes along its coordinate: [N] of a slide, [N m] of a turn; * in "
        "a name stands for any characters",
    )
    elements: int | None = option(
        "--elements",
        metavar="COUNT",
        type=int,
        help="Into how many cubic elements every beam is divided, 1 to 64. By default, one with "
        "inner modes, and more where it bends far.",
    )


def named_values(option: str, texts: tuple[str, ...], expected: str) -> list[tuple[str, str]]:
    """Names and values of ``NAME=VALUE``, in which a name may have an equals sign.

    Raises InputError when one of both is missing.
    """
    pairs = []
    for text in texts:
        name, equals, value = (piece.strip() for piece in text.rpartition("="))
        if not (name and equals and value):
            raise InputError(option, got=text, expected=expected)
        pairs.append((name, value))
    return pairs


def named_once(option: str, texts: tuple[str, ...], expected: str) -> dict[str, str]:
    """`named_values`, of which each name may stand once."""
    values: dict[str, str] = {}
    for name, value in named_values(option, texts, expected):
        if name in values:
            raise InputError(option, got=f"{name}={value}", expected=f"one value for {name}")
        values[name] = value
    return values
