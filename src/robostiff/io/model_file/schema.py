"""JSON schema of the model file, for editors: keys to complete, and words to show beside them."""

from __future__ import annotations

import json
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, models_json_schema

from robostiff.io.model_file.cables import WrittenCableRobot
from robostiff.io.model_file.robots import WrittenArm, WrittenMachine, WrittenRobot
from robostiff.io.validation import WithoutTitles

#: What a key means, where its model does not say; of one part alone as PART.key.
_MEANINGS = {
    "robostiff": "the version of this format, 1",
    "title": "what the robot is, in a line",
    "notes": "free text",
    "parameters": "names and their values, which expressions may use, such as {R: 300 mm}",
    "coordinates": "the pose coordinates that can be chosen freely; the legs fix the others",
    "reference_point": "about which stiffness is given, in the platform frame; its origin if left "
    "out",
    "turn": "successive rotations about current axes, such as [{z: 30 deg}, {y: 10 deg}]",
    "rotation_vector": "its direction is the axis, its length the angle, such as [0, 0, 30 deg]",
    "matrix": "rotation, three rows; its columns are the turned axes",
    "axes": "the directions of two of the new axes, such as {x: [1, 1, 0], z: z}",
    "at": "the origin [x, y, z], zero if left out",
    "Spring.at": "the point about which the matrix is given",
    "Weight.at": "where the weight acts, in the platform frame",
    "node": "a node of the flexible platform, in place of a frame",
    "type": "the kind of element or joint",
    "name": "unique in its chain; the type and a number if left out",
    "y_axis": "y of the cross-section, where Iy and Iz differ",
    "theory": "euler-bernoulli, or timoshenko, which adds shear",
    "taper": "segments of the beam from start to end, in place of section",
    "start": "frame in which the chain begins, relative to the frame before the block",
    "end": "frame in which the chain ends, relative to the frame after the block",
    "let": "further variables of each copy, such as {phi: i*120 deg}",
    "EA": "axial stiffness of the cable per strain, such as 80 kN",
    "guide_length": "of the cable between winch and exit",
    "winch_stiffness": "N/m; rigid if left out",
    "least_tension": "N; that of tensions if left out",
    "greatest_tension": "N; that of tensions if left out",
    "tension": "a given tension of this cable, N",
    "planar": "true for a robot in the x-y plane, computed with 3 x 3 matrices",
    "weight": "a force of constant direction on the platform",
    "tensions": "limits of the tensions of all cables",
    "stiffness": "of the drive or lock, N/m for a slide and N m/rad for a turn; rigid if left out",
    "Spring.stiffness": "6 x 6, or the six of its diagonal",
    "Link.stiffness": "6 x 6 of the far end, or the six of its diagonal",
    "PlatformSpring.stiffness": "6 x 6, or the six of its diagonal",
    "compliance": "6 x 6, or the six of its diagonal",
    "limits": "[lowest, highest] coordinate of an actuated joint",
    "home": "coordinate in the home configuration, a list for several; zero if left out",
    "Robot.home": "frame of the platform in the home configuration, such as {at: [0, 0, 800 mm]}",
    "mount": "frame in which the module begins, in the platform frame of the module before",
    "Module.chain": "elements in series, from the module before to the next",
    "Module.legs": "the legs of a robot, which is described in place",
    "Module.home": "frame of the platform of these legs in the home configuration",
    "base": "where the chain begins, a frame in the world",
    "tool": "frame of the tool in that of the last row",
    "a": "along x",
    "alpha": "about x",
    "d": "along z; a joint that slides adds its coordinate",
    "theta": "about z; a joint that turns adds its coordinate",
    "platform": "where the chain ends, a frame of the platform",
    "Robot.platform": "a flexible platform: nodes, and the beams and springs between them",
    "elbow": "which of two ways a leg with a crank or slide takes: plus, minus or as at home",
    "G": "shear modulus",
    "poisson_ratio": "in place of G, for an isotropic material",
    "Material.source": "where the numbers come from",
    "beams": "from base to tip; of a platform, in any order",
    "springs": "elastic connections between two nodes",
    "Robot.springs": "springs between points of two bodies, such as gravity compensators",
    "laws": "force of a drive by its motion q, as {leg1/strut: k*q + c*q^3}, or a table of both",
    "BodyPoint.at": "in the world, in the platform frame, or in the frame where the part begins",
    "free_length": "distance without tension; or preload",
    "preload": "tension in the home configuration, negative where it pushes; or free_length",
    "rigid": "rigid members between two nodes",
    "to": "the point to which the part leads, [x, y, z] in the present frame",
    "materials": "named materials, such as {alloy: {E: 70 GPa, poisson_ratio: 0.33}}",
    "sections": "named cross-sections, such as {rod: {circle: {diameter: 20 mm}}}",
    "share": "the part of the extension that lengthens this beam",
    "fixed": "length at zero extension",
    "Segment.material": "of this segment; that of the beam if left out",
    "section": "a name, or a shape such as {circle: {diameter: 20 mm}}",
}


def model_file_schema() -> dict[str, Any]:
    """JSON schema (draft 2020-12) of the model file: with legs, `dh`, `cables` or `modules`.

    It checks keys, types and shapes, for completion and hints in an editor; `rs.load` also
    checks values, units and names.
    """
    written = (WrittenRobot, WrittenArm, WrittenCableRobot, WrittenMachine)
    _, schema = models_json_schema(
        [(model, "validation") for model in written], schema_generator=WithoutTitles
    )
    definitions = {}
    for name, definition in schema["$defs"].items():
        part = definitions[_part(name)] = {**definition, "title": _part(name)}
        for key, value in definition.get("properties", {}).items():
            words = value.get("description") or _MEANINGS.get(f"{_part(name)}.{key}")
            if words := words or _MEANINGS.get(key):
                part["properties"] = {**part["properties"], key: {**value, "description": words}}
    robot, arm, cables, machine = (
        {"$ref": f"#/$defs/{_part(model.__name__)}"} for model in written
    )
    whole = {
        "$schema": GenerateJsonSchema.schema_dialect,
        "title": "robostiff model file",
        "type": "object",
        "if": {"required": ["dh"]},
        "then": arm,
        "else": {
            "if": {"required": ["cables"]},
            "then": cables,
            "else": {"if": {"required": ["modules"]}, "then": machine, "else": robot},
        },
        "$defs": definitions,
    }
    return json.loads(json.dumps(whole).replace("#/$defs/Written", "#/$defs/"))


def _part(name: str) -> str:
    return name.removeprefix("Written")
