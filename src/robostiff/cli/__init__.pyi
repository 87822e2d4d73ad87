from robostiff.cli.arguments import machine_of, pose, wrench
from robostiff.cli.options import Answer, Command, Model, Posing, group, option, wrench_option
from robostiff.cli.output import show

__all__ = [
    "Answer",
    "Command",
    "Model",
    "Posing",
    "group",
    "machine_of",
    "option",
    "pose",
    "show",
    "wrench",
    "wrench_option",
]
