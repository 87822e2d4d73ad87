"""From the table of a serial arm in a model file to a robot of the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from robostiff.io.model_file.build_joint import build_joint
from robostiff.io.model_file.geometry import point, transform
from robostiff.io.model_file.place import Place
from robostiff.io.model_file.written_arm import WrittenArm, WrittenDHRow
from robostiff.io.model_file.written_elements import WrittenOneAxisJoint
from robostiff.io.units import Dimension
from robostiff.model import Coordinate, DHConvention, DHRow, Joint, Robot, serial_arm


def build_arm(top: Place, written: WrittenArm, coordinates: Sequence[Coordinate]) -> Robot:
    """The arm of a table that is written, not yet verified."""
    place, table = top / "dh", written.dh
    where = [place / "joints" / i for i in range(len(table.joints))]
    rows, joints = zip(*map(_row, where, table.joints), strict=True)
    with place.complaints():
        arm = serial_arm(
            rows,
            convention=DHConvention(table.convention),
            joint_stiffness=[joint.role.stiffness for joint in joints],
            limits=[joint.role.limits for joint in joints],
            home=[joint.home[0] if joint.home_given else None for joint in joints],
            base=transform(place / "base", table.base),
            tool=None if table.tool is None else transform(place / "tool", table.tool),
            name=written.name,
            coordinates=coordinates,
            title=written.title,
            source=written.source,
        )
    return replace(arm, reference_point=point(top / "reference_point", written.reference_point))


def _row(place: Place, written: WrittenDHRow) -> tuple[DHRow, Joint]:
    """A row, and the joint with what is written of its drive."""
    drive = {key: getattr(written, key) for key in ("type", "stiffness", "limits", "home")}
    joint = build_joint(place, WrittenOneAxisJoint(**drive, role="actuated", axis="z"), "")
    with place.complaints():
        row = DHRow(
            a=(place / "a").number(written.a, Dimension.LENGTH),
            alpha=(place / "alpha").number(written.alpha, Dimension.ANGLE),
            d=(place / "d").number(written.d, Dimension.LENGTH),
            theta=(place / "theta").number(written.theta, Dimension.ANGLE),
            slides=written.type == "prismatic",
            name=written.name or "",
        )
    return row, joint
