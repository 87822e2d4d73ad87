from robostiff.cli.arguments import load_machine, pose, wrench
from robostiff.cli.options import Answer, Command, Model, Posing, group, option, wrench_option
from robostiff.cli.output import show

__all__ = [
    "Answer",
    "Command",
    "Model",
    "Posing",
    "group",
    "load_machine",
    "option",
    "pose",
    "show",
    "wrench",
    "wrench_option",
]
