"""Which kind of robot a model file describes, as it is written."""

from robostiff.errors import FileError
from robostiff.io.document import Document
from robostiff.io.model_file.written_arm import WrittenArm
from robostiff.io.model_file.written_robot import (
    WrittenMachine,
    WrittenRobot,
    check_version,
)
from robostiff.io.suggest import Words
from robostiff.io.validation import validate

WrittenModel = WrittenRobot | WrittenArm | WrittenMachine

#: What describes a robot, the key that shows it, and what to write instead of two of them.
_KINDS = {
    "dh": (
        WrittenArm,
        "a table describes a serial arm as a whole; write its elements as a leg to add elastic "
        "links",
    ),
    "modules": (WrittenMachine, "legs beside other modules are a module of their own"),
}


def written_model(document: Document) -> WrittenModel:
    """A model file as it is written: a robot of legs, an arm by its table, or a hybrid machine.

    Raises
    ------
    FileError
        At the place that is to blame.
    """
    check_version(document)
    for key, (kind, hint) in _KINDS.items():
        if key in document.data:
            if "legs" in document.data:
                raise FileError(
                    document.key_location(("legs",)),
                    "legs",
                    got=Words(f"legs beside {key}"),
                    expected="one of them",
                    hint=hint,
                )
            return validate(kind, document)
    return validate(WrittenRobot, document)
