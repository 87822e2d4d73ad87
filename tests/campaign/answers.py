"""What a way says of a robot at a pose, and where ways contradict one another or the reference."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from robostiff.elastostatics import Status
from tests.campaign.reference import CUT, DOUBT, Reference
from tests.cases.metric import distance

AGREEMENT = 1e-9
#: A block of this part of the other is the square of a lever arm of 1e-6 of the robot, of which
#: coordinates that are rounded a few times (1e-15) have nine digits; smaller ones have fewer.
_LEAST = 1e-12
#: The input decides no more digits than it has: an answer may be as far off as the exact answers of
#: robots whose coordinates differ by one unit in the last place, and no further than this.
_OF_INPUT = 1e-8
#: Which of several redundant joints is left out is no part of the input: more follows from that.
_OF_CHOICE = 1e-6
#: Differences between a way and itself in other company: the same steps, other roundings.
_NEAR_CUT = (0.1 * CUT, 10 * CUT)
DECISIVE = (
    Status.RIGID_DIRECTION | Status.FREE_MOTIONS | Status.REDUNDANT_JOINTS | Status.UNREACHABLE
)


@dataclass(frozen=True)
class Answer:
    """What one way says.

    Attributes
    ----------
    way : str
    K : array or None
    status : Status or None
        None where the way has none, such as exported code.
    rank : int or None
    C : array or None
        Compliance, where the way gives one.
    error : str
        An exception in place of an answer.
    truth : Reference or None
        Of a robot whose coordinates were rounded anew on this way.
    neighbours : callable
        As those of the judge, of this robot.
    """

    way: str
    K: np.ndarray | None = None
    status: Status | None = None
    rank: int | None = None
    C: np.ndarray | None = None
    error: str = ""
    truth: Reference | None = None
    neighbours: Callable[[], Sequence[Reference]] = tuple

    @property
    def in_doubt(self) -> bool:
        """Whether it says itself that few digits hold."""
        return self.status is not None and bool(self.status & Status.ILL_CONDITIONED)

    def __str__(self) -> str:
        if self.error:
            return f"{self.way}: {self.error}"
        status = "no status" if self.status is None else str(self.status)
        return f"{self.way}: {status}, rank {self.rank}"


@dataclass(frozen=True)
class Complaint:
    """A contradiction.

    Attributes
    ----------
    way : str
        The way that is wrong, or differs.
    what : str
        What is wrong, without numbers.
    detail : str
    """

    way: str
    what: str
    detail: str

    def __str__(self) -> str:
        return f"{self.way}: {self.what} ({self.detail})"


@dataclass
class Judge:
    """Collects the contradictions of one robot at one pose.

    Attributes
    ----------
    truth : Reference or None
    size : float
        Length of the robot [m].
    has_blocks : bool
    neighbours : callable
        Gives references of robots that differ from it by rounding of their coordinates, and by
        which redundant joint they lack.
    complaints : list of Complaint
    """

    truth: Reference | None
    size: float
    has_blocks: bool
    neighbours: Callable[[], Sequence[Reference]] = tuple
    complaints: list[Complaint] = field(default_factory=list)

    def say(self, way: str, what: str, detail: str) -> None:
        """Keep a contradiction."""
        self.complaints.append(Complaint(way, what, detail))

    def hear(self, answer: Answer, default: Answer | None) -> None:
        """Compare an answer with the reference, and with the default way."""
        if answer.error:
            self.say(answer.way, f"raised {answer.error.split(':')[0]}", answer.error[:300])
            return
        if answer.status is not None and answer.status & Status.FORM_DOES_NOT_HOLD:
            return
        truth = answer.truth or self.truth
        if truth is not None:
            self._against_truth(answer, truth)
        another = answer.way == "tilted"  # another robot, with a joint more
        if not another and default is not None and default is not answer and not default.error:
            self._against_default(answer, default)

    def _against_truth(self, answer: Answer, truth: Reference) -> None:
        status = answer.status
        margins = f"margins {', '.join(f'{m:.1e}' for m in truth.margins if m > 1e-15)}"
        if status is not None:
            if status & Status.UNREACHABLE:
                return
            is_clear = not any(_NEAR_CUT[0] < m < _NEAR_CUT[1] for m in truth.margins)
            if not answer.in_doubt:
                rigid = bool(status & Status.RIGID_DIRECTION)
                if rigid != truth.is_rigid:
                    word = "rigid, and is not" if rigid else "not rigid, and is"
                    self.say(answer.way, f"called {word}", f"{status}; {margins}")
                    return
            if not answer.in_doubt or is_clear:  # the tolerance decides, whatever the digits
                if answer.rank is not None and answer.rank != truth.rank:
                    detail = f"{answer.rank} for {truth.rank}; {status}; {margins}"
                    self.say(answer.way, "another rank", detail)
                    return
                redundant = bool(status & Status.REDUNDANT_JOINTS)
                if not self.has_blocks and redundant != truth.is_redundant:
                    word = "redundant, and is not" if redundant else "not redundant, and is"
                    self.say(answer.way, f"called {word}", f"{status}; {margins}")
        if answer.in_doubt or truth.rank == 0:
            return
        for name, size in (("K", self.size), ("C", 1 / self.size)):
            given, exact = getattr(answer, name), getattr(truth, name)
            if given is None or exact is None:
                continue
            least = _least_of(truth)
            off = self.distance(given, exact, size, least)
            if not off <= AGREEMENT and not self._of_input(answer, name, size, least):
                what = f"another {name} than the reference"
                self.say(answer.way, what, f"{off:.2e}; {status}; {margins}")

    def _of_input(self, answer: Answer, name: str, size: float, least: float) -> bool:
        """Whether rounding of the input moves every block of the exact answer as far."""
        truth = answer.truth or self.truth
        near = self.neighbours if answer.truth is None else answer.neighbours
        if truth is None:
            return False
        given, exact = getattr(answer, name), getattr(truth, name)
        others = [own for one in near() if (own := getattr(one, name)) is not None]
        most = _OF_CHOICE if truth.is_redundant else _OF_INPUT
        turns = (np.arange(len(exact)) >= (2 if len(exact) == 3 else 3)).astype(int)
        for block in range(3):  # of forces, of coupling, of moments
            own = np.add.outer(turns, turns) == block
            off, *moved = (
                self.distance(np.where(own, K, exact), exact, size, least) for K in (given, *others)
            )
            if not off <= max(AGREEMENT, min(max(moved, default=0.0), most)):
                return False
        return True

    def _against_default(self, answer: Answer, default: Answer) -> None:
        doubt = answer.in_doubt or default.in_doubt
        if answer.status is not None and default.status is not None:
            differ = (answer.status ^ default.status) & DECISIVE
            if (differ or answer.rank != default.rank) and not doubt:
                self.say(
                    answer.way,
                    f"another status ({differ})" if differ else "another rank than the default",
                    f"{answer.status}, rank {answer.rank} for "
                    f"{default.status}, rank {default.rank}",
                )
                return
        if doubt or default.rank in (0, -1):
            return
        if answer.K is not None and default.K is not None and answer.truth is None:
            off = self.distance(answer.K, default.K)
            if not off <= 2 * AGREEMENT:
                self.say(answer.way, "another K than the default", f"{off:.2e}; {answer.status}")

    def distance(
        self, K: np.ndarray, other: np.ndarray, size: float | None = None, least: float = _LEAST
    ) -> float:
        """In units of the blocks; what is not finite is infinitely far."""
        if not np.all(np.isfinite(K)):
            return np.inf
        if not np.any(other):
            return 0.0 if not np.any(K) else np.inf
        return distance(K, other, self.size if size is None else size, least=least)


def _least_of(truth: Reference) -> float:
    """Below which part of the other a block has fewer than nine digits.

    What lies within the tolerance counts as aligned, by the package and by the reference: both are
    off by as much of the whole, and need not choose the same joint to leave out.
    """
    aligned = sum(value for value in truth.margins if DOUBT[0] < value < CUT)
    return max(_LEAST, min(1.0, (aligned / AGREEMENT) ** 2))
