"""Weighted residuals and their Jacobian; all columns of differences run as lanes of one block per experiment."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import IdentificationError
from ppafo.identification.trajectory.columns import trajectories
from ppafo.identification.trajectory.paths import TIME_OFFSET, with_numbers
from ppafo.identification.trajectory.preparation import Floats, Prepared
from ppafo.identification.trajectory.ranges import Range

Mask = NDArray[np.bool_]

FIRST_STEP = 1.0e-3
"""Step of a difference before standard errors are known: the share of a number by which it is moved."""

_TOUCH = 1.0e-9


class Whitens(Protocol):
    """A linear map that makes columns of residuals white."""

    def of(self, values: Floats) -> Floats:
        """Return columns (samples, columns) whitened."""
        ...


@dataclass(frozen=True, slots=True)
class Residuals:
    """What is to be made small: (model - sample) / noise of all channels, then (coordinate - prior) / deviation.

    With ``whitening`` the former are made white by what is known of the noise of each sensor.
    """

    experiments: tuple[Prepared, ...]
    ranges: tuple[Range, ...]
    whitening: Whitens | None = None

    def of_data(self, points: Floats) -> Floats:
        """Return the residuals of the samples (samples, points) at points (points, coordinates); NaN if a run fails."""
        signals = trajectories(self.experiments, self.ranges, points)
        parts = [
            (of_one[channel.name] - channel.values[:, None]) / channel.noise
            for prepared, of_one in zip(self.experiments, signals, strict=True)
            for channel in prepared.channels
        ]
        values = np.concatenate(parts)
        return values if self.whitening is None else self.whitening.of(values)

    def of_priors(self, point: Floats) -> Floats:
        """Return the residuals of the priors, one for each parameter that has one."""
        mean, deviation, has = prior_coordinates(self.ranges)
        return (point[has] - mean[has]) / deviation[has]

    def channel_slices(self) -> tuple[slice, ...]:
        """Return the place of each channel among the residuals of the samples."""
        lengths = [len(channel.values) for item in self.experiments for channel in item.channels]
        ends = np.cumsum(lengths).tolist()
        return tuple(slice(end - length, end) for end, length in zip(ends, lengths, strict=True))

    def around(self, point: Floats, directions: Floats) -> "Neighbourhood":
        """Return the residuals at a point and one step away from it along each direction (the columns), all at once."""
        values = self.of_data(np.vstack([point + directions.T, point - directions.T, point]))
        return Neighbourhood(self, point, directions, values)

    def holding(self, held: Mapping[int, float]) -> "Residuals":
        """Return the residuals of the other parameters, some (by place) being held at a coordinate."""
        names = {self.ranges[index]: self.ranges[index].number(at) for index, at in held.items()}

        def with_held(prepared: Prepared) -> Prepared:
            acting = {item.path: number for item, number in names.items() if item.acts_in(prepared.label)}
            offset = acting.pop(TIME_OFFSET, prepared.time_offset)
            return replace(prepared, scenario=with_numbers(prepared.scenario, acting), time_offset=offset)

        ranges = tuple(item for place, item in enumerate(self.ranges) if place not in held)
        return replace(self, experiments=tuple(with_held(one) for one in self.experiments), ranges=ranges)


@dataclass(frozen=True, slots=True)
class Neighbourhood:
    """Residuals of the samples one step after a point along each direction, one step before it, and (last) at it."""

    residuals: Residuals
    point: Floats
    directions: Floats
    values: Floats

    @property
    def of_data(self) -> Floats:
        """Residuals of the samples at the point."""
        return self.values[:, -1]

    def all_residuals(self) -> Floats:
        """Return all residuals at the point, those of the priors last."""
        return np.concatenate([self.of_data, self.residuals.of_priors(self.point)])

    def jacobian_of_data(self) -> Floats:
        """Return the derivative of the residuals of the samples by the coordinates, by central differences.

        Where a step leaves the bounds on one side, or the run there fails, the difference is one-sided.
        """
        count = self.directions.shape[1]
        above, below, centre = self.values[:, :count], self.values[:, count:-1], self.values[:, -1:]
        use_above = self._is_inside(self.directions) & np.isfinite(above).all(axis=0)
        use_below = self._is_inside(-self.directions) & np.isfinite(below).all(axis=0)
        self._refuse_hopeless(~(use_above | use_below))
        change = np.where(use_above, above, centre) - np.where(use_below, below, centre)
        return np.asarray((change / (1.0 * use_above + use_below)) @ np.linalg.inv(self.directions))

    def jacobian(self) -> Floats:
        """Return the derivative of ``all_residuals`` by the coordinates."""
        _, deviation, has = prior_coordinates(self.residuals.ranges)
        return np.concatenate([self.jacobian_of_data(), np.diag(1.0 / deviation)[has]])

    def _is_inside(self, directions: Floats) -> Mask:
        low, high = coordinate_bounds(self.residuals.ranges)
        reached, touch = self.point[:, None] + directions, _TOUCH * np.abs(directions)
        inside = (reached <= high[:, None] + touch) & (reached >= low[:, None] - touch)
        return np.asarray(inside.all(axis=0))

    def _refuse_hopeless(self, hopeless: Mask) -> None:
        for direction in self.directions.T[hopeless]:
            index = int(np.argmax(np.abs(direction)))
            item = self.residuals.ranges[index]
            raise IdentificationError(
                f"{item.name}: no run succeeds next to {item.number(float(self.point[index])):.6g}, so nothing can be "
                f"said about it; give other bounds or another start"
            )


def coordinate_bounds(ranges: Sequence[Range]) -> tuple[Floats, Floats]:
    """Return the bounds of all coordinates."""
    low = np.array([item.coordinate(item.low) for item in ranges])
    return low, np.array([item.coordinate(item.high) for item in ranges])


def prior_coordinates(ranges: Sequence[Range]) -> tuple[Floats, Floats, Mask]:
    """Return mean and standard deviation of the priors in coordinates, infinitely wide without, and who has one."""
    mean, deviation = np.zeros(len(ranges)), np.full(len(ranges), np.inf)
    for index, item in enumerate(ranges):
        if item.prior is not None:
            mean[index] = item.coordinate(item.prior.mean)
            deviation[index] = item.prior.standard_deviation / abs(item.slope(float(mean[index])))
    return mean, deviation, np.isfinite(deviation)
