from robostiff.cli.options import Answer, Command, Model, Posing, group, option, wrench_option
from robostiff.cli.output import show
from robostiff.cli.written_arguments import loaded, pose_from, wrench_from

__all__ = [
    "Answer",
    "Command",
    "Model",
    "Posing",
    "group",
    "loaded",
    "option",
    "pose_from",
    "show",
    "wrench_from",
    "wrench_option",
]
