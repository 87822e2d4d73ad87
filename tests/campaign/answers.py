"""What a way says of a robot at a pose, and where ways contradict one another or the reference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from robostiff.elastostatics import Status
from tests.campaign.reference import Reference
from tests.cases.metric import distance

AGREEMENT = 1e-9
#: A block of this part of the other is the square of a lever arm of 1e-6 of the robot, of which
#: coordinates that are rounded a few times (1e-15) have nine digits; smaller ones have fewer.
_LEAST = 1e-12
#: Differences between a way and itself in other company: the same steps, other roundings.
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
    """

    way: str
    K: np.ndarray | None = None
    status: Status | None = None
    rank: int | None = None
    C: np.ndarray | None = None
    error: str = ""
    truth: Reference | None = None

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

    @property
    def key(self) -> tuple[str, str]:
        """What stays the same while a failure is shrunk."""
        return self.way, self.what

    def __str__(self) -> str:
        return f"{self.way}: {self.what} ({self.detail})"


@dataclass
class Judge:
    """Collects the contradictions of one robot at one pose."""

    truth: Reference | None
    size: float
    has_blocks: bool
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
        if default is not None and default is not answer and not default.error:
            self._against_default(answer, default)

    def _against_truth(self, answer: Answer, truth: Reference) -> None:
        status = answer.status
        margins = f"margins {', '.join(f'{m:.1e}' for m in truth.margins if m > 1e-15)}"
        if status is not None:
            if status & Status.UNREACHABLE:
                return
            if not answer.in_doubt:
                rigid = bool(status & Status.RIGID_DIRECTION)
                if rigid != truth.is_rigid:
                    word = "rigid, and is not" if rigid else "not rigid, and is"
                    self.say(answer.way, f"called {word}", f"{status}; {margins}")
                    return
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
        if answer.K is not None and truth.K is not None:
            off = self.distance(answer.K, truth.K)
            if not off <= AGREEMENT:
                self.say(
                    answer.way, "another K than the reference", f"{off:.2e}; {status}; {margins}"
                )
        if answer.C is not None and truth.C is not None:
            off = self.distance(answer.C, truth.C, 1 / self.size)
            if not off <= AGREEMENT:
                self.say(
                    answer.way, "another C than the reference", f"{off:.2e}; {status}; {margins}"
                )

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

    def distance(self, K: np.ndarray, other: np.ndarray, size: float | None = None) -> float:
        """In units of the blocks; what is not finite is infinitely far."""
        if not np.all(np.isfinite(K)):
            return np.inf
        if not np.any(other):
            return 0.0 if not np.any(K) else np.inf
        return distance(K, other, self.size if size is None else size, least=_LEAST)


def keys_of(complaints: Sequence[Complaint]) -> set[tuple[str, str]]:
    """What a failure is known by."""
    return {complaint.key for complaint in complaints}
