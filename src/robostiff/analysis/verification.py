"""A stiffness matrix by all methods, the distances between them, and whether they agree."""

from __future__ import annotations

from enum import Enum
from typing import Any

import numpy as np

from robostiff.analysis.posed_stiffness import direct_stiffness
from robostiff.analysis.questions import StructuralAnalysis
from robostiff.analysis.result import Stiffness, require_one_pose
from robostiff.elastostatics import (
    DEFAULT_TOLERANCE,
    Block,
    Form,
    IndexRules,
    Recursive,
    SaddlePoint,
    Status,
    Tolerance,
    matrix_distance,
)
from robostiff.errors import InputError, NoAnswerError, TooFewDigitsError
from robostiff.frozen import frozen
from robostiff.kinematics import Near, Pose
from robostiff.linkage import DriveValues, Linkage
from robostiff.markup import InNotebooks
from robostiff.model import Robot, Snapshot
from robostiff.network import Network, energy_stiffness, network_of_snapshot

_FORMS: tuple[Form, ...] = (SaddlePoint(), Block(), Recursive(), IndexRules())
_AGREEMENT = 1e-9


class Outcome(Enum):
    """Outcome of the comparison with one method."""

    AGREES = "agrees"
    DIFFERS = "differs"
    DOUBTFUL = "doubtful"
    DOES_NOT_HOLD = "does not hold"


@frozen
class Comparison:
    """Comparison of one method with the reference.

    Attributes
    ----------
    method : str
    outcome : Outcome
        DOUBTFUL differs, and reports itself that few digits hold.
    distance : float or None
        Largest difference in units of its block; None without two matrices.
    rank : int or None
        None where the method decides none.
    reason : str
        Why it does not hold, or how it differs.
    """

    method: str
    outcome: Outcome
    distance: float | None
    rank: int | None
    reason: str


@frozen
class Verification(InNotebooks):
    """The stiffness of a robot at a pose by several methods.

    Attributes
    ----------
    reference : Stiffness
        With what the others are compared: the wrench basis form, or the network.
    comparisons : tuple of Comparison
    agreement : float
        Distance up to which matrices agree.
    """

    reference: Stiffness
    comparisons: tuple[Comparison, ...]
    agreement: float

    @property
    def agree(self) -> bool:
        """Whether no method differs, and at least one other holds."""
        outcomes = {comparison.outcome for comparison in self.comparisons}
        return Outcome.AGREES in outcomes and Outcome.DIFFERS not in outcomes

    def __repr__(self) -> str:
        each = ", ".join(f"{one.method} {one.outcome.value}" for one in self.comparisons)
        return f"<Verification of {self.reference.name!r}: {each}>"


def verify(
    robot: Robot | Snapshot | Network | Linkage,
    pose: Pose | DriveValues = None,
    *,
    near: Near = None,
    agreement: float = _AGREEMENT,
    tolerance: Tolerance = DEFAULT_TOLERANCE,
) -> Verification:
    """Compare the stiffness at a pose by every form of K_C, as a network, and by least energy.

    The forms share the compliance and the joints of each leg; the network and the energy share
    neither, only where joints and springs are. Agreement shows that the matrix follows from the
    robot as described, not that the description is right.

    Parameters
    ----------
    robot : Robot, Snapshot, Network or Linkage
        Of a network or a linkage only the two methods for networks hold.
    pose : as for `stiffness`
        One pose.
    near : joint coordinates, optional
        Those that choose the posture, as for `stiffness`.
    agreement : float
        Distance up to which matrices agree, in units of the largest entry of each block.
    tolerance : Tolerance

    Raises
    ------
    InputError
        When several poses are given, or `agreement` is not between 0 and 1.
    NoAnswerError
        When the pose is out of reach.

    Examples
    --------
    >>> import robostiff as rs
    >>> checked = verify(rs.load("hexapod"))
    >>> checked.agree, [comparison.method for comparison in checked.comparisons][-2:]
    (True, ['network', 'energy'])
    """
    if not 0 < agreement < 1:
        raise InputError("agreement", got=agreement, expected="a number between 0 and 1")
    reference = direct_stiffness(robot, pose, near=near, tolerance=tolerance)
    require_one_pose("a verification", reference.batch_shape)
    if Status.UNREACHABLE in reference.status:
        raise NoAnswerError(f"nothing to verify: {'; '.join(reference.advice)}")
    placed: Any = reference.placed()
    network, others = placed, []
    if reference.question.has_legs:
        network = network_of_snapshot(placed)
        others = [
            direct_stiffness(robot, pose, method=form, near=near, tolerance=tolerance)
            for form in _FORMS
        ]
    if not isinstance(reference.method, StructuralAnalysis):
        others.append(direct_stiffness(network, tolerance=tolerance))
    comparisons = []
    for other in others:
        name, why = other.method.name, other.status
        if Status.FORM_DOES_NOT_HOLD in why:
            reason = other.details().reason
            comparisons.append(Comparison(name, Outcome.DOES_NOT_HOLD, None, None, reason))
            continue
        rigid = Status.RIGID_DIRECTION in why
        K, reason = (None, "a rigid direction") if rigid else (other.K, "")
        known = name, K, int(other.rank), reason, Status.ILL_CONDITIONED in why
        comparisons.append(_comparison(reference, agreement, *known))
    K, reason = None, "no rigid direction" if Status.RIGID_DIRECTION in reference.status else ""
    try:
        K = energy_stiffness(network, tolerance)
    except TooFewDigitsError as error:
        energy = Comparison("energy", Outcome.DOES_NOT_HOLD, None, None, str(error))
        return Verification(reference, (*comparisons, energy), agreement)
    except NoAnswerError as error:
        reason = str(error)
    comparisons.append(_comparison(reference, agreement, "energy", K, None, reason, False))
    return Verification(reference, tuple(comparisons), agreement)


def _comparison(
    reference: Stiffness,
    agreement: float,
    method: str,
    K: np.ndarray | None,
    rank: int | None,
    reason: str,
    doubtful: bool,
) -> Comparison:
    """The comparison with what a method found; None for K where a direction is rigid."""
    doubtful |= Status.ILL_CONDITIONED in reference.status
    differs = Outcome.DOUBTFUL if doubtful else Outcome.DIFFERS
    rigid = Status.RIGID_DIRECTION in reference.status
    if rigid or K is None:
        agrees = rigid and K is None
        return Comparison(method, Outcome.AGREES if agrees else differs, None, rank, reason)
    distance = matrix_distance(K, reference.K, float(reference.length))
    if rank is not None and rank != reference.rank:
        reason = f"rank {rank}, and not {int(reference.rank)}"
    agrees = distance <= agreement and not reason
    return Comparison(method, Outcome.AGREES if agrees else differs, distance, rank, reason)
