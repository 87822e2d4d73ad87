"""What an identification found: values, their uncertainty, residuals, and the robot."""

from __future__ import annotations

import os
from enum import Flag
from functools import cached_property, reduce
from operator import or_
from pathlib import Path

import numpy as np

from robostiff.errors import InputError, NoAnswerError
from robostiff.frozen import frozen, replace
from robostiff.identification.measurements import Measurements
from robostiff.identification.readings import ReadingModel
from robostiff.identification.search import Fit, Robust, Squares, fit
from robostiff.identification.unknowns import Unknown, UnknownKind
from robostiff.identification.written_values import write_values
from robostiff.kinematics.turn import turn_by_vector
from robostiff.markup import InNotebooks, number
from robostiff.model import Robot
from robostiff.spatial.rotation import vector_of_rotation

# Of a reading, as a share of the largest: what Newton's method leaves.
_ROUNDING = 1e-10
# A fit is none where a sum of squares as large as this is so rare; an outlier as rare for one of
# all readings.
_NO_FIT, _OUTLIER = 1e-3, 0.01
# Of a standard deviation: as near to a bound as this is at it.
_AT_BOUND = 1e-2


class FitStatus(Flag):
    """What happened to a fit; ``OK`` is none of the others."""

    OK = 0
    NOT_IDENTIFIED = 1
    WEAK = 2
    AT_BOUND = 4
    DOES_NOT_FIT = 8
    OUTLIERS = 16
    NOT_CONVERGED = 32
    TOO_FEW_ROWS = 64

    @property
    def is_bad(self) -> bool:
        """Whether values are not what was asked for."""
        return bool(self & ~(FitStatus.WEAK | FitStatus.OUTLIERS))

    @property
    def words(self) -> str:
        """Such as ``at-bound, weak``."""
        return ", ".join(str(member.name).lower().replace("_", "-") for member in self) or "ok"

    def __str__(self) -> str:
        return self.words


@frozen
class CrossValidation:
    """Errors at postures that a fit has not seen."""

    #: (N, 3) or (N, 6): of readings, each by the fit to the other postures; NaN where none is read
    errors: np.ndarray
    rms: float  #: root of their mean square [m], of what is read of markers
    rms_of_fit: float  #: that of the fit to all postures [m]


@frozen(eq=False, repr=False)
class Identified(InNotebooks):
    """What `identify` found."""

    model: ReadingModel  #: readings as functions of the unknowns
    fit: Fit

    @property
    def measured(self) -> Measurements:
        """The campaign."""
        return self.model.measured

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Parameters, then places of instrument and markers."""
        return self.model.unknowns

    @property
    def names(self) -> tuple[str, ...]:
        """Of the unknowns that were found: rows of covariance and correlations."""
        return tuple(self.unknowns[k].name for k in self._identified)

    @cached_property
    def values(self) -> dict[str, float]:
        """Of all unknowns [SI]; those that are not identified keep the nominal ones.

        The turn of the instrument is the rotation vector that takes components in world axes to
        those in instrument axes, the opposite of that of a pose, and its covariance that of a
        further rotation; turns of markers are those to platform axes. Empty where there are too few
        readings.
        """
        if self.fit.too_few:
            return {}
        model, x = self.model, self.fit.x.copy()
        R, _, b, m, turns = model.frames(x)
        turns = vector_of_rotation(turn_by_vector(turns) @ model.first_turns)
        frames = np.concatenate([b, vector_of_rotation(R), m.ravel(), turns.ravel()])
        x[len(model.parameters) :] = frames[model.sought]
        return dict(zip((unknown.name for unknown in self.unknowns), x.tolist(), strict=True))

    @cached_property
    def _identified(self) -> list[int]:
        if self.fit.too_few:
            return []
        return [k for k in range(len(self.unknowns)) if k not in self.fit.identifiability.fixed]

    @cached_property
    def _scaled(self) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (M,) over their standard deviations, and their rates; weights of the loss."""
        known, sigma = self.fit.known, self.model.sigma
        y, J = self.model.prediction(self.fit.x)
        r = (self.model.values - y)[known] / sigma[known]
        A = J[known][:, self._identified] / sigma[known][:, None]
        scale = getattr(self.fit.loss, "scale", None)
        if scale is not None:
            size = 1.0 if self.measured.has_sigma else 1.4826 * float(np.median(np.abs(r)))
            weight = (1 + (r / (scale * size)) ** 2) ** -0.25
            r, A = r * weight, A * weight[:, None]
        return r, A

    @property
    def degrees_of_freedom(self) -> int:
        """Numbers that were read less those that were found."""
        return int(np.count_nonzero(self.fit.known)) - len(self._identified)

    @cached_property
    def chi_square(self) -> float:
        """Sum of squares of residuals over their standard deviations; [m^2] where none are known.

        Of a robust loss with its weights.
        """
        r, _ = self._scaled
        return float(r @ r)

    @cached_property
    def sigma(self) -> float:
        """Standard deviation of readings: 1 of given ones, or as it is estimated [m]."""
        if self.measured.has_sigma:
            return 1.0
        return (self.chi_square / max(self.degrees_of_freedom, 1)) ** 0.5

    @cached_property
    def _inverse_root(self) -> np.ndarray:
        """Root of the covariance at unit standard deviation: R^-1 of ``A = Q R``."""
        A = self._scaled[1]
        length = np.linalg.norm(A, axis=0)
        return np.linalg.inv(np.linalg.qr(A / length, mode="r")) / length[:, None]

    @cached_property
    def covariance(self) -> np.ndarray:
        """Of the unknowns `names`, to first order."""
        return self.sigma**2 * self._inverse_root @ self._inverse_root.T

    @cached_property
    def correlations(self) -> np.ndarray:
        """Of the unknowns `names`."""
        d = np.sqrt(np.diag(self.covariance))
        return self.covariance / np.outer(d, d)

    @cached_property
    def std(self) -> dict[str, float]:
        """Standard deviations of what was found."""
        d = np.sqrt(np.diag(self.covariance))
        return dict(zip(self.names, d.tolist(), strict=True))

    @cached_property
    def at_bound(self) -> dict[str, str]:
        """Unknowns at a bound: ``least`` or ``largest``."""
        sides = {}
        for k, d in zip(self._identified, np.sqrt(np.diag(self.covariance)), strict=True):
            low, high = (bound[k] for bound in self.fit.bounds)
            if self.fit.x[k] - low <= _AT_BOUND * d:
                sides[self.unknowns[k].name] = "least"
            elif high - self.fit.x[k] <= _AT_BOUND * d:
                sides[self.unknowns[k].name] = "largest"
        return sides

    def interval(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Intervals that hold a true value with this probability, by name.

        Of Student's distribution where the standard deviation is estimated; on one side for what
        is at a bound. What was not identified has none.
        """
        from scipy.stats import norm, t

        if not 0 < level < 1:
            raise InputError("level of an interval", got=level, expected="between 0 and 1")
        dof = max(self.degrees_of_freedom, 1)

        def width(p: float) -> float:
            return float(norm.ppf(p) if self.measured.has_sigma else t.ppf(p, dof))

        two_sided, one_sided = width(0.5 + 0.5 * level), width(level)
        intervals = {}
        for name, d in self.std.items():
            x, side = self.values[name], self.at_bound.get(name)
            intervals[name] = (
                x - d * (0.0 if side == "least" else one_sided if side else two_sided),
                x + d * (0.0 if side == "largest" else one_sided if side else two_sided),
            )
        return intervals

    def stiffness_interval(self, name: str, level: float = 0.95) -> tuple[float, float, float]:
        """Stiffness of a compliance, and the image of its interval; infinite where it reaches 0."""
        intervals = self.interval(level)
        parts = [p.name for p in self.model.parameters if p.kind is UnknownKind.COMPLIANCE]
        if name not in parts or name not in intervals:
            found = ", ".join(part for part in parts if part in intervals)
            expected = f"a compliance that was found: {found or 'there is none'}"
            raise InputError("stiffness interval", got=name, expected=expected)
        low, high = intervals[name]
        return 1 / self.values[name], 1 / high, (1 / low if low > 0 else np.inf)

    @cached_property
    def residuals(self) -> np.ndarray:
        """What was read less what is predicted, as its values; not a number where none is."""
        return self._as_values(self.model, self.model.values - self.model.prediction(self.fit.x)[0])

    @staticmethod
    def _as_values(model: ReadingModel, numbers: np.ndarray) -> np.ndarray:
        """Numbers (M,) where readings (N, width) have them."""
        values = np.full(model.measured.values.shape, np.nan)
        values.ravel()[model.read] = numbers
        return values

    @cached_property
    def _left_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Leverage of readings (N,), and what leaving one out takes from the sum of squares."""
        r, A = self._scaled
        (count, width), read = self.measured.values.shape, np.flatnonzero(self.model.read)
        read = read[self.fit.known]
        residual, Q = np.zeros(width * count), np.zeros((width * count, A.shape[1]))
        residual[read], Q[read] = r, A @ self._inverse_root
        residual, Q = residual.reshape(-1, width), Q.reshape(count, width, -1)
        H = Q @ np.swapaxes(Q, 1, 2)
        # what decides an unknown alone has no residual
        outside = np.linalg.solve(np.eye(width) * (1 + 1e-12) - H, residual[:, :, None])[:, :, 0]
        return np.trace(H, axis1=1, axis2=2), np.sum(residual * outside, axis=1)

    @property
    def leverage(self) -> np.ndarray:
        """How many unknowns each reading (N,) decides by itself; their sum is that of all."""
        return self._left_out[0]

    @cached_property
    def outlier_probability(self) -> np.ndarray:
        """How rare a reading (N,) as far from the fit to the others would be: F of both sums."""
        from scipy.stats import f

        (count, width), read = self.measured.values.shape, self.model.read
        reading = np.repeat(np.arange(count), width)[read][self.fit.known]
        size = np.maximum(np.bincount(reading, minlength=count), 1)
        rest = np.maximum(self.degrees_of_freedom - size, 1)
        less, known = self._left_out[1], self.fit.known
        # residuals of this size are rounding, which has no outliers
        least = _ROUNDING * np.max(np.abs(self.model.values / self.model.sigma)[known])
        others = np.maximum(self.chi_square - less, rest * least**2 + 1e-300)
        return f.sf((less / size) / (others / rest), size, rest)

    @cached_property
    def outliers(self) -> tuple[int, ...]:
        """Readings that do not fit to the others, the worst first."""
        p = self.outlier_probability
        order = np.argsort(p, kind="stable")
        return tuple(int(k) for k in order if p[k] < _OUTLIER / len(p))

    @cached_property
    def probability(self) -> float:
        """That of a sum of squares as large, of a model that is right; 1 without given sigma."""
        from scipy.stats import chi2

        if not self.measured.has_sigma or self.degrees_of_freedom < 1:
            return 1.0
        return float(chi2.sf(self.chi_square, self.degrees_of_freedom))

    @property
    def not_identified(self) -> tuple[str, ...]:
        """What no reading tells, in sentences."""
        return self.fit.identifiability.not_identified

    @property
    def weak(self) -> tuple[str, ...]:
        """What readings hardly tell, in sentences: what the status ``weak`` is about."""
        return self.fit.identifiability.weak

    @property
    def correlated(self) -> tuple[str, ...]:
        """Whose errors go together by 0.9 to 0.98, in sentences."""
        return self.fit.identifiability.correlated

    @cached_property
    def status(self) -> FitStatus:
        """What happened."""
        if self.fit.too_few:
            return FitStatus.TOO_FEW_ROWS
        facts = {
            FitStatus.NOT_IDENTIFIED: self.not_identified,
            FitStatus.WEAK: self.weak,
            FitStatus.AT_BOUND: self.at_bound,
            FitStatus.DOES_NOT_FIT: self.probability < _NO_FIT,
            FitStatus.OUTLIERS: self.outliers,
            FitStatus.NOT_CONVERGED: not self.fit.converged,
        }
        return reduce(or_, (status for status, holds in facts.items() if holds), FitStatus.OK)

    @cached_property
    def advice(self) -> tuple[str, ...]:
        """What to do, in sentences."""
        if self.fit.too_few:
            return (self.fit.too_few,)
        sentences = [*self.not_identified, *self.weak, *self.correlated]
        for name, side in self.at_bound.items():
            sentences.append(f"{name} is at its {side} value: its interval has one side")
        if FitStatus.DOES_NOT_FIT in self.status:
            size = (self.chi_square / self.degrees_of_freedom) ** 0.5
            sentences.append(
                f"residuals are {number(size, 3)} times as "
                "large as the given standard deviations allow: something moves that is not among "
                "the parameters, or sigma is too small"
            )
        if self.outliers:
            places = [self.measured.place(k) for k in self.outliers[:5]]
            more = len(self.outliers) - len(places)
            sentences.append(
                f"far from the fit to the others: {', '.join(places)}"
                f"{f' and {more} more' if more else ''}; read again or remove them"
            )
        if not self.fit.converged:
            sentences.append("the search did not end; give fewer parameters, or other start values")
        lost = int(np.count_nonzero(~self.fit.known))
        if lost:
            sentences.append(f"{lost} numbers near singular postures were left out")
        return tuple(sentences)

    @cached_property
    def robot(self) -> Robot:
        """The robot with the values that were found.

        Raises NoAnswerError where there are too few readings. Play is no part of it.
        """
        return self.model.statics.robot.substituted(self._without_play())

    def _without_play(self) -> dict[str, float]:
        """Values of the parameters by name, play zero."""
        self._check_rows()
        return {p.name: 0.0 if p.plays else self.values[p.name] for p in self.model.parameters}

    @property
    def estimate(self) -> tuple[Robot, dict[str, float], np.ndarray]:
        """The robot with symbols for parameters that were found, their values, and covariance.

        Play is no part of it, and the places of instrument and markers are left out.

        Raises NoAnswerError where there are too few readings.
        """
        rest, robot = self._without_play(), self.model.statics.robot
        found = [p.name for p in self.model.parameters if p.name in self.std and not p.plays]
        values = {name: rest.pop(name) for name in found}
        robot = robot.substituted(rest) if rest else robot
        rows = [self.names.index(name) for name in found]
        changed = replace(robot, nominal={**robot.nominal, **values})
        return changed, values, self.covariance[np.ix_(rows, rows)]

    def _check_rows(self) -> None:
        if self.fit.too_few:
            raise NoAnswerError(self.fit.too_few)

    def write(
        self, path: str | os.PathLike[str], source: str | os.PathLike[str], level: float = 0.95
    ) -> None:
        """Write the model file `source` with the values that were found, as a new file.

        Comments and order stay; behind each value stands its uncertainty.

        Raises
        ------
        InputError
            When a value has no place of its own in the file.
        """
        self._check_rows()
        values, intervals = {}, self.interval(level)
        about = f"({number(100 * level)} %), from {Path(self.measured.source).name}"
        for unknown in self.model.parameters:
            value, comment = self.values[unknown.name], "not identified"
            if unknown.name in intervals:
                low, high = intervals[unknown.name]
                half, is_length = 0.5 * (high - low), unknown.kind is UnknownKind.GEOMETRY
                size = f"{number(100 * half / abs(value), 2)} %"
                if is_length:  # the value has the unit of the file
                    size = f"{number(half, 2)} {unknown.unit}".rstrip()
                comment = f"+-{size} {about}, {len(self.measured)} readings"
            values[unknown] = value, comment
        write_values(values, self.robot, path, source)

    def predict(self, measured: Measurements) -> tuple[np.ndarray, np.ndarray]:
        """What would be read elsewhere, and its standard deviation by that of the unknowns.

        Parameters
        ----------
        measured : Measurements
            Postures, loads and markers; its values say which numbers are wanted.

        Returns
        -------
        two (N, 3) or (N, 6) arrays, as the values.
        """
        self._check_rows()
        model = self.model.of(measured, self.fit.x)
        y, J = model.prediction(self.fit.x)
        L = J[:, self._identified] @ self._inverse_root * self.sigma
        return self._as_values(model, y), self._as_values(model, np.linalg.norm(L, axis=1))

    def fitted_to(self, measured: Measurements, loss: Squares | Robust | None = None) -> Identified:
        """The same unknowns from other readings of the same markers; the search begins here.

        Parameters
        ----------
        measured : Measurements
        loss : Squares or Robust, optional
            That of this fit when left out.
        """
        model, x = self.model.of(measured, self.fit.x), self.fit.x
        return Identified(*fit(model, x, self.fit.bounds, loss or self.fit.loss))

    def cross_validated(self, folds: int = 5, seed: int = 0) -> CrossValidation:
        """What the model does at postures it has not seen: fits without a part of them each.

        Raises
        ------
        InputError
            When there are fewer postures than folds.
        """
        posture = np.unique(self.measured.coordinates, axis=0, return_inverse=True)[1].ravel()
        count = int(posture.max()) + 1
        if not isinstance(folds, int) or not 2 <= folds <= count:
            raise InputError("folds", got=folds, expected=f"2 to {count}, the number of postures")
        fold = np.random.default_rng(seed).permutation(count) % folds
        errors = np.full(self.measured.values.shape, np.nan)
        for k in range(folds):
            out = fold[posture] == k
            rest = self.measured.chosen(~out)
            if set(rest.marker_names) != set(self.model.names):
                raise InputError("folds", got=folds, expected="less: a marker is in one part alone")
            model = self.fitted_to(rest)
            part = self.measured.chosen(out)
            gaps = np.where(part.is_read, part.values - model.predict(part)[0], np.nan)
            errors[out, : gaps.shape[1]] = gaps
        rows = ~self.measured.of_drives
        rms, of_fit = (
            float(np.sqrt(np.nanmean(gaps[rows][:, :3] ** 2))) for gaps in (errors, self.residuals)
        )
        return CrossValidation(errors, rms, of_fit)

    def __repr__(self) -> str:
        if self.fit.too_few:
            return f"<Identified: {self.fit.too_few}; status {self.status}>"
        names = [unknown.name for unknown in self.model.parameters if unknown.name in self.std]
        parts = [
            f"{name} = {number(self.values[name])} +- {number(self.std[name], 2)}"
            for name in names[:8]
        ]
        more = [f"{len(names) - 8} more"] if len(names) > 8 else []
        return f"<Identified: {', '.join([*parts, *more])}; status {self.status}>"
