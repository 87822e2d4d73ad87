"""The page of arguments: which function takes which, from their signatures.

python docs/make_arguments_page.py > docs/arguments.md
"""

import inspect
import sys

import robostiff as rs

#: What each argument means, in the order of the columns.
ARGUMENTS = {
    "pose": "where the machine stands: a pose, joint or actuator coordinates, many of them in one "
    "array, or nothing for home ([conventions](conventions.md))",
    "near": "joint coordinates that choose among postures; the next to home when left out",
    "at": "the point that twists and wrenches are about, in world axes [m]; the reference point of "
    "the machine when left out",
    "wrench": "force, then moment about that point, in world axes [N, N m]",
    "loads": "forces and masses at bodies, by their names ([under load](under-load.md))",
    "gravity": "acceleration of free fall, three numbers [m/s²] or an axis such as `-z`",
    "preload": "forces and moments of joints in the unloaded posture, by their names [N, N m]",
    "laws": "force laws of joints, by their names, in place of their stiffness",
    "beams": "how beams bend under load: `rs.Bowing()`, or straight ones",
    "tensions": "the rule by which cables are tensioned ([cables](cables.md))",
    "length": "the length that rotations are multiplied by, where they are compared with "
    "translations [m]; that of the machine when left out",
    "tolerance": "what counts as zero, an `rs.Tolerance`",
}
#: Functions that ask a machine something.
VERBS = (
    *("find_posture", "stiffness", "compliance", "deflection", "indices", "verify"),
    *("equilibrium", "critical_load", "load_path", "modes", "cable_stiffness"),
    *("cable_tensions", "cable_response", "stiffness_map", "compile_loaded"),
    *("compensate", "write_report"),
)

HEAD = """\
# Arguments, the same in all functions

An argument has one name and one meaning in every function that takes it. The machine comes first,
then the pose, then the wrench; all others are given by name.

| argument | meaning |
|---|---|
"""

TABLE = """
A dot says that the function takes the argument; `first`, `second` and `third` that it may also
stand without its name.

"""

FOOT = """
Results have their values under the same names, as far as they have them: `K`, `compliance`,
`rank`, `status`, `advice`, `pose`, `reference_point`, `space`, and `name` of the machine.

This page is written by `docs/make_arguments_page.py` from the signatures.
"""

_PLACES = ("first", "second", "third")


def main() -> None:
    sys.stdout.write(page())


def page() -> str:
    """The whole page."""
    meanings = "".join(f"| `{name}` | {words} |\n" for name, words in ARGUMENTS.items())
    return HEAD + meanings + TABLE + table() + FOOT


def table() -> str:
    """A row for each function, a column for each argument."""
    rows = [f"| `rs.` | {' | '.join(ARGUMENTS)} |", "|---|" + ":---:|" * len(ARGUMENTS)]
    for verb in VERBS:
        parameters = inspect.signature(getattr(rs, verb)).parameters
        cells = [_cell(list(parameters.values()), name) for name in ARGUMENTS]
        rows.append(f"| `{verb}` | {' | '.join(cells)} |")
    return "\n".join(rows) + "\n"


def _cell(parameters: list[inspect.Parameter], name: str) -> str:
    for place, own in enumerate(parameters):
        if own.name == name:
            by_name = own.kind is inspect.Parameter.KEYWORD_ONLY or place >= len(_PLACES)
            return "·" if by_name else _PLACES[place]
    return ""


if __name__ == "__main__":
    main()
