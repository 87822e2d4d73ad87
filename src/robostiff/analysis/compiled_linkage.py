"""Compiled linkages: a kernel at many values of driven joints, and networks where it is unsafe."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.compiled_answer import (
    AtGeneralPoses,
    CompiledStiffness,
    attempted,
    checked_outputs,
    closes,
)
from robostiff.analysis.kernel_inputs import InputRows, ParameterValues, with_parameters
from robostiff.analysis.linkage_stiffness import FREE, SUBJECT, linkage_stiffness
from robostiff.analysis.measures import differences
from robostiff.analysis.result import RobotStiffness
from robostiff.compiled import (
    Backend,
    Derivative,
    Kernel,
    Output,
    StiffnessMatrix,
    kernel_of,
)
from robostiff.elastostatics import DEFAULT_TOLERANCE, Status
from robostiff.errors import DisagreementError, InputError
from robostiff.linkage import Configuration, DrivenLinkage, DriveValues, Linkage
from robostiff.linkage.driven import coordinate_names
from robostiff.linkage.recorded_stiffness import record_linkage
from robostiff.recorded import RecordedRobot
from robostiff.recorded.parameters import parameter_samples

_OTHER_SEED = 47
_NEARER = 4  # how often samples are drawn nearer to home


@dataclass(frozen=True, repr=False)
class CompiledLinkage(CompiledStiffness):
    """A linkage whose stiffness is recorded once and evaluated at many configurations; picklable.

    Unsafe configurations are recomputed as networks.

    Attributes
    ----------
    rank, status, verified, kernel
        See `CompiledStiffness`. The kernel takes the coordinates of the drives, then parameters.
    driven : DrivenLinkage
        The part between base and platform, and what drives it. Its symbols are the parameters.
    """

    driven: DrivenLinkage

    @property
    def subject(self) -> Linkage:
        """The part between base and platform."""
        return self.driven.part

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the coordinates that it takes."""
        return self.driven.inputs

    def _given(
        self, pose: DriveValues, parameters: Mapping[str, ArrayLike] | None
    ) -> tuple[Kernel, InputRows, np.ndarray, ParameterValues[Linkage]]:
        driven, rows = self.driven, self.driven.rows(pose)
        if rows.ndim == 3 and rows.shape[1] == 1:  # a column (N, 1) of a joint with one coordinate
            rows = rows[:, 0]
        if rows.ndim != 2:
            n = len(driven.inputs)
            raise InputError(
                f"driven joints of {driven.part.name!r}",
                got=f"shape {rows.shape[:-1]} of poses",
                expected=f"numbers (N,) of each joint, or an array (N, {n}), one pose a row",
            )
        values = ParameterValues.of(driven.part, parameters, len(rows))
        return self.kernel, _as_inputs(driven, rows, values), rows, values

    def _careful(self, robot: Linkage, pose: DriveValues, given: np.ndarray) -> RobotStiffness:
        return linkage_stiffness(replace(self.driven, part=robot), given)


def compile_linkage(
    linkage: Linkage,
    outputs: Sequence[Output] = (StiffnessMatrix(),),
    *,
    joints: Sequence[str] | None = None,
    parameters: Sequence[str] = (),
    backend: Backend = Backend.BEST,
) -> CompiledLinkage:
    """Record the stiffness of a linkage once, for evaluation at many configurations.

    Newton steps from home close the loops, as for legs without closed form. Wrenches that circulate
    in the loops are eliminated by the passive joints, and K follows from the energy of the rest.
    Poses where a check of the record fails are computed again as networks.

    Arguments are those of `compile_robot`; ``Derivative(output, "crank")`` with a coordinate of a
    driven joint.
    """
    names = [name for c in linkage.connections for name in coordinate_names(c)]
    driven = DrivenLinkage.of(with_parameters(linkage, parameters, names), joints)
    return compile_driven(driven, checked_outputs(outputs), backend)


def compile_driven(
    driven: DrivenLinkage,
    outputs: Sequence[Output] = (StiffnessMatrix(),),
    backend: Backend = Backend.BEST,
) -> CompiledLinkage:
    """As `compile_linkage`, from what drives it."""
    recorded, undetermined, samples, nearer = _recorded(driven)
    for output in outputs:
        if isinstance(output, Derivative) and isinstance(output.of, Derivative):
            raise InputError(
                f"derivative {output.name}",
                got=f"{driven.part.name!r}, whose loops are closed by iteration",
                expected="first derivatives",
            )
    kernel = kernel_of(recorded, outputs, backend)
    others = driven.samples(_OTHER_SEED, nearer)
    verified = _is_trusted(driven, recorded, undetermined, (samples, others))
    return CompiledLinkage(recorded.factors.rank, recorded.status, verified, kernel, driven)


def _recorded(
    driven: DrivenLinkage,
) -> tuple[RecordedRobot, tuple[str, ...], list[Configuration], int]:
    """The record, joints left undetermined, samples, and how near these are to home.

    They are as near as home's surroundings are regular.
    """
    for nearer in range(_NEARER):
        samples = driven.samples(nearer=nearer)
        recorded, undetermined = record_linkage(driven, samples)
        if recorded is not None:
            return recorded, undetermined, samples, nearer
        if undetermined:
            raise _undetermined(driven, undetermined)
    raise InputError(
        f"home of {driven.part.name!r}",
        got="a configuration in which assembly modes meet",
        expected="a regular home for a kernel",
        hint="give another home, or use linkage.network_at pose by pose",
    )


def _is_trusted(
    driven: DrivenLinkage,
    recorded: RecordedRobot,
    undetermined: tuple[str, ...],
    drawn: Sequence[list[Configuration]],
) -> bool:
    """Whether a record has been confirmed at generic poses, those of its own samples and others."""
    general = AtGeneralPoses(recorded.factors.rank, recorded.status, verified=True)
    kernel = kernel_of(recorded, (StiffnessMatrix(),), Backend.ARRAYS)
    strict = replace(DEFAULT_TOLERANCE, near_independence=1e-4, near_rigidity=1e-9)
    trusted = True
    for seed, own in enumerate(drawn):
        rows = np.array([driven.given_in(one) for one in own])
        some = {name: values[seed] for name, values in parameter_samples(driven.part).items()}
        given = ParameterValues.of(driven.part, some, len(rows))
        closed = closes(kernel, kernel.evaluate(_as_inputs(driven, rows, given).rows))
        if not closed.any():
            return False
        rows, given = rows[closed], replace(given, rows=given.rows[:, closed])
        answer = attempted(kernel, _as_inputs(driven, rows, given), general, 1)
        part = driven.part.substituted(some) if some else driven.part
        careful = linkage_stiffness(replace(driven, part=part), rows, strict)
        doubtful = (careful.status_codes & int(Status.ILL_CONDITIONED)) != 0
        trusted &= not doubtful.any()
        K, rank, codes = answer.values["K"], answer.rank, answer.status_codes
        for k, distance in differences(K, rank, codes, careful, free=FREE):
            if not (answer.guarded[k] or doubtful[k]):
                if undetermined:
                    raise _undetermined(driven, undetermined)
                place = dict(zip(driven.inputs, rows[k].tolist(), strict=True))
                raise DisagreementError(SUBJECT, distance, f"{driven.part.name!r} at {place}")
            trusted = False
    return trusted


def _undetermined(driven: DrivenLinkage, names: Sequence[str]) -> InputError:
    return InputError(
        f"driven joints of {driven.part.name!r}",
        got=f"{', '.join(driven.drives)}, which leave {', '.join(names)} undetermined",
        expected="joints that decide the configuration",
        hint="add them, joints=(...), or use linkage.network_at pose by pose",
    )


def _as_inputs(
    driven: DrivenLinkage, rows: np.ndarray, given: ParameterValues[Linkage]
) -> InputRows:
    """Rows of a kernel; steps from home do not count the turns of screws."""
    inputs = np.concatenate([rows.T, given.rows]) if len(given.rows) else rows.T
    return InputRows(inputs, np.zeros(len(rows), dtype=bool), driven.turned_far(rows))
