"""Compiled linkages: a kernel at many values of driven joints, and networks where it is unsafe."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from robostiff.analysis.compiled_answer import (
    CompiledAnswer,
    attempted,
    checked_chunks,
    checked_outputs,
    put_careful,
)
from robostiff.analysis.guarded_values import AtGeneralPoses, CheckedResults, closes
from robostiff.analysis.kernel_inputs import InputRows, ParameterValues, with_parameters
from robostiff.analysis.linkage_stiffness import FREE, SUBJECT, linkage_stiffness
from robostiff.analysis.record_agreement import differences
from robostiff.compiled import (
    Backend,
    Derivative,
    Kernel,
    Output,
    StiffnessMatrix,
    kernel_of,
    whole_threads,
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
class CompiledLinkage:
    """A linkage whose stiffness is recorded once and evaluated at many configurations; picklable.

    Attributes
    ----------
    driven : DrivenLinkage
        The part between base and platform, and what drives it. Its symbols are the parameters.
    kernel : Kernel
        Takes the coordinates of the drives, then parameters.
    rank : int
        At a general pose.
    status : Status
        At a general pose.
    verified : bool
        Whether record and network were found to agree at generic poses; False where those are
        ill-conditioned, and every pose is then computed as a network.
    """

    driven: DrivenLinkage
    kernel: Kernel
    rank: int
    status: Status
    verified: bool

    def __repr__(self) -> str:
        names = ", ".join(output.name for output in self.kernel.outputs)
        return (
            f"<CompiledLinkage {self.driven.part.name!r}: {names} at {', '.join(self.inputs)}, "
            f"{self.kernel.operations} operations>"
        )

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the coordinates that it takes."""
        return self.driven.inputs

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, which may differ from pose to pose."""
        return tuple(str(symbol) for symbol in self.driven.part.symbols)

    def evaluate(
        self,
        values: DriveValues,
        *,
        parameters: Mapping[str, ArrayLike] | None = None,
        threads: int = 1,
    ) -> CompiledAnswer:
        """Outputs, status and rank at many values of the driven joints.

        Parameters
        ----------
        values : (N, n) array, or mapping of str to (N,) arrays
            Coordinates of the drives in the order of `inputs`, one pose a row; or by the names of
            the joints, (N, size) for a joint with several; those left out stay at home [m, rad].
        parameters : mapping of str to a number or (N,) array, optional
            Values of parameters, in SI units; nominal where left out.
        threads : int

        Raises
        ------
        InputError
            When the values do not fit the driven joints.
        """
        answer, rows, given = self._attempt(values, parameters, threads)
        for part, again in given.groups(answer.guarded):
            result = linkage_stiffness(replace(self.driven, part=part), rows[again])
            put_careful(answer, again, result, self.kernel.outputs, self.rank)
        return answer

    def attempt(
        self,
        values: DriveValues,
        *,
        parameters: Mapping[str, ArrayLike] | None = None,
        threads: int = 1,
    ) -> CompiledAnswer:
        """As `evaluate`, but poses that are ``guarded`` are left to the caller.

        What stands there in the answer must not be used.
        """
        return self._attempt(values, parameters, threads)[0]

    def results(
        self, values: DriveValues, *, parameters: Mapping[str, ArrayLike] | None = None
    ) -> Iterator[tuple[slice, CheckedResults]]:
        """Which poses, and rows of results at them, chunk by chunk; see `CompiledRobot.results`."""
        inputs = _as_inputs(*self._given(values, parameters))
        general = AtGeneralPoses(self.rank, self.status, self.verified)
        yield from checked_chunks(self.kernel, inputs, general, slice(0, len(inputs.missed)))

    def _attempt(
        self, values: DriveValues, parameters: Mapping[str, ArrayLike] | None, threads: int
    ) -> tuple[CompiledAnswer, np.ndarray, ParameterValues[Linkage]]:
        threads = whole_threads(threads)
        rows, given = self._given(values, parameters)
        general = AtGeneralPoses(self.rank, self.status, self.verified)
        return attempted(self.kernel, _as_inputs(rows, given), general, threads), rows, given

    def _given(
        self, values: DriveValues, parameters: Mapping[str, ArrayLike] | None
    ) -> tuple[np.ndarray, ParameterValues[Linkage]]:
        rows = _one_a_row(self.driven, values)
        return rows, ParameterValues.of(self.driven.part, parameters, len(rows))


def _one_a_row(driven: DrivenLinkage, values: DriveValues) -> np.ndarray:
    """Values of driven joints as rows (N, n) in the order of ``driven.inputs``.

    Raises
    ------
    InputError
        When they do not fit the joints, or are not one pose a row.
    """
    rows = driven.rows(values)
    if rows.ndim == 3 and rows.shape[1] == 1:  # a column (N, 1) of a joint with one coordinate
        rows = rows[:, 0]
    if rows.ndim != 2:
        n = len(driven.inputs)
        raise InputError(
            f"driven joints of {driven.part.name!r}",
            got=f"shape {rows.shape[:-1]} of poses",
            expected=f"numbers (N,) of each joint, or an array (N, {n}), one pose a row",
        )
    return rows


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

    Parameters
    ----------
    linkage : Linkage
    outputs : sequence of Output
        As for robots; ``Derivative(output, "crank")`` with a coordinate of a driven joint.
    joints : sequence of str, optional
        Names of the joints that drive it; all actuated ones when left out. The other ones follow,
        as in ``linkage.network_at``.
    parameters : sequence of str
        Names of symbols that stay open, to be given with the poses.
    backend : Backend
        ``Backend.MACHINE``, ``Backend.ARRAYS``, or the ``BEST`` there is.

    Raises
    ------
    InputError
        When the loops do not close at home or around it, home is singular, the driven joints leave
        the posture undetermined, or a direction is rigid.
    NoAnswerError
        When an output has no answer at any pose.
    DisagreementError
        When the record and the network give different answers at a generic pose.

    Examples
    --------
    >>> import robostiff as rs
    >>> linkage = rs.load_linkage("double-pantograph")
    >>> fast = compile_linkage(linkage)
    >>> fast.inputs
    ('screw',)
    >>> K = fast.evaluate({"screw": np.linspace(-0.2, 0.05, 100)}).values["K"]
    >>> there = rs.stiffness(linkage.network_at({"screw": 0.05})).K
    >>> bool(np.allclose(K[-1], there, rtol=1e-9, atol=1e-9 * there.max()))
    True
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
    found = _Recorded.of(driven)
    recorded = found.recorded
    for output in outputs:
        if isinstance(output, Derivative) and isinstance(output.of, Derivative):
            raise InputError(
                f"derivative {output.name}",
                got=f"{driven.part.name!r}, whose loops are closed by iteration",
                expected="first derivatives",
            )
    kernel = kernel_of(recorded, outputs, backend)
    verified = found.is_trusted()
    return CompiledLinkage(driven, kernel, recorded.factors.rank, recorded.status, verified)


@dataclass(frozen=True)
class _Recorded:
    """The record of a linkage, its samples, and how near to home they are."""

    driven: DrivenLinkage
    recorded: RecordedRobot
    undetermined: tuple[str, ...]
    samples: list[Configuration]
    nearer: int

    @classmethod
    def of(cls, driven: DrivenLinkage) -> _Recorded:
        """With samples as near as home's surroundings are regular."""
        for nearer in range(_NEARER):
            samples = driven.samples(nearer=nearer)
            recorded, undetermined = record_linkage(driven, samples)
            if recorded is not None:
                return cls(driven, recorded, undetermined, samples, nearer)
            if undetermined:
                raise _undetermined(driven, undetermined)
        raise InputError(
            f"home of {driven.part.name!r}",
            got="a configuration in which assembly modes meet",
            expected="a regular home for a kernel",
            hint="give another home, or use linkage.network_at pose by pose",
        )

    def is_trusted(self) -> bool:
        """Whether it has been confirmed at generic poses, those of its own samples and others.

        Raises
        ------
        DisagreementError
            When record and network differ at a pose where both are well conditioned.
        InputError
            When K depends on joints that are left undetermined.
        """
        driven, recorded = self.driven, self.recorded
        general = AtGeneralPoses(recorded.factors.rank, recorded.status, verified=True)
        kernel = kernel_of(recorded, (StiffnessMatrix(),), Backend.ARRAYS)
        strict = replace(DEFAULT_TOLERANCE, near_independence=1e-4, near_rigidity=1e-9)
        trusted = True
        other = driven.samples(_OTHER_SEED, self.nearer)
        for seed, own in enumerate((self.samples, other)):
            rows = np.array([driven.given_in(one) for one in own])
            some = {name: values[seed] for name, values in parameter_samples(driven.part).items()}
            given = ParameterValues.of(driven.part, some, len(rows))
            closed = closes(kernel, kernel.evaluate(_as_inputs(rows, given).rows))
            if not closed.any():
                return False
            rows, given = rows[closed], replace(given, rows=given.rows[:, closed])
            answer = attempted(kernel, _as_inputs(rows, given), general, 1)
            part = driven.part.substituted(some) if some else driven.part
            careful = linkage_stiffness(replace(driven, part=part), rows, strict)
            doubtful = (careful.status_codes & int(Status.ILL_CONDITIONED)) != 0
            trusted &= not doubtful.any()
            K, rank, codes = answer.values["K"], answer.rank, answer.status_codes
            for k, distance in differences(K, rank, codes, careful, free=FREE):
                if not (answer.guarded[k] or doubtful[k]):
                    if self.undetermined:
                        raise _undetermined(driven, self.undetermined)
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


def _as_inputs(rows: np.ndarray, given: ParameterValues[Linkage]) -> InputRows:
    none = np.zeros(len(rows), dtype=bool)
    return InputRows(
        np.concatenate([rows.T, given.rows]) if len(given.rows) else rows.T, none, none
    )
