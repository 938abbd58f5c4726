"""Derivatives of the expected spectral matrix of one vehicle with its load, by its parameters and its load.

The chain rule leads from parameters to the numbers in the equations of motion (car), to the responses (response), to
the spectra, in closed forms and real matrix products. These take four bytes a number: a step of a search, and the width
of a peak, need no more than their six digits. Left out is what other parameters than the driveline's own change of the
difference that a group's speed makes to it; the costs have it. Shapes are those of expected.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Final

import numpy as np

from gateway.model.buffers import buffer
from gateway.model.car import IN_MOTION, numbers_about
from gateway.model.expected import (
    DELAY_SCALE,
    KNOTS,
    NOISES,
    REAR_LAG,
    TRACK_OFFSET,
    TRACKS_APART,
    TWIST_LEVEL,
    Expected,
    tapered,
)
from gateway.model.spectra import PAIRS
from gateway.model.table import INDEX
from gateway.model.tracks import coherence_of, coherence_slope_of
from gateway.records import F32, F64

_DRIVELINES: Final = [INDEX["driveline_front_kg"], INDEX["driveline_rear_kg"]]
_OF_ROAD: Final = (DELAY_SCALE, REAR_LAG, TRACK_OFFSET, TRACKS_APART, TWIST_LEVEL)
_LOCAL: Final = [[*knots, noise] for knots, noise in zip(KNOTS, NOISES, strict=True)]


@dataclass(frozen=True, slots=True)
class Slopes:
    """Derivatives of the matrix by e parameters, apart from the growth of the noise.

    dense (b, m + 2, p^2, r) are without the taper. local (p, 11, b, m), with it, change one sensor's own power: by each
    knot of its slack, and last by its noise; (p, 0, b, m) if none of these is among the parameters. The slope by a
    parameter is the sum of these columns, the dense ones first, times its column of ``by`` (r + 11 p, e).
    """

    dense: F32
    local: F64
    by: F64


def slopes_of(e: Expected, free: Sequence[int]) -> Slopes:
    """Slopes by the ``free`` entries of theta (n,) and, numbered from n on, of the load; some share a column."""
    g, chain, plan = e.groups, _Chain(e), _plan_of(tuple(free), e.theta.shape[1], e.groups.n_sensors)
    by_number, far = numbers_about(e.natural[0], e.load[:, 0], g.ground, plan.moving)
    r = len(far)
    dense = buffer("dense", (*e.phase.shape[1:], g.n_sensors**2, r + len(plan.of_road)))
    np.matmul(chain.by_response(), chain.of_responses(by_number).swapaxes(1, 2), out=dense[..., :r])
    b, m, parts, n_dense = dense.shape
    columns = dense.reshape(b, m * parts, n_dense).transpose(2, 0, 1)
    for column in far[:, plan.where_driveline].argmax(axis=0).tolist() if r else ():
        columns[column] *= g.speed_ratio
    for column, entry in enumerate(plan.of_road, r):
        by_entry = chain.by_road(entry).reshape(g.n_sensors**2, -1).T
        columns[column] = np.ascontiguousarray(by_entry).reshape(columns.shape[1:])
    by = np.zeros((r + len(plan.others), len(plan.free)))
    by[:r, plan.where_moving] = far
    by[r:] = plan.others
    return Slopes(dense, chain.local()[:, : len(plan.of_sensors[0])], by)


@dataclass(frozen=True)
class _Plan:
    """Which columns of Slopes the entries ``free`` of theta (n,) and of the load need, of p sensors."""

    free: tuple[int, ...]
    n: int
    p: int

    @cached_property
    def moving(self) -> list[int]:
        """Entries in the equations of motion."""
        return [i for i in self.free if i >= self.n or i in IN_MOTION]

    @cached_property
    def where_moving(self) -> list[int]:
        """Places of ``moving`` in ``free``."""
        return [self.free.index(i) for i in self.moving]

    @cached_property
    def where_driveline(self) -> list[int]:
        """Places of the drivelines in ``moving``."""
        return [self.moving.index(i) for i in _DRIVELINES if i in self.free]

    @cached_property
    def of_road(self) -> list[int]:
        """Entries of the road's way to the wheels."""
        return [i for i in _OF_ROAD if i in self.free]

    @cached_property
    def of_sensors(self) -> list[list[int]]:
        """Entries of each sensor's slack and noise; none if no sensor's are free."""
        every = _LOCAL[: self.p]
        return every if any(i in self.free for one in every for i in one) else [[] for _ in every]

    @cached_property
    def others(self) -> F64:
        """The rows of Slopes.by below those of ``moving``."""
        each = [*self.of_road, *(i for one in self.of_sensors for i in one)]
        return np.array([[float(i == j) for j in self.free] for i in each]).reshape(len(each), len(self.free))


_plan_of = cache(_Plan)


class _Chain:
    """The links of the chain between numbers, responses and the matrix, all with the road's slope."""

    def __init__(self, e: Expected) -> None:
        self._e, self._g = e, e.groups
        self._paths = e.paths[:, :, 0]
        self._p, self._s = self._paths.shape[:2]
        self._late, self._phase = e.late[:, :, 0], e.phase[0]
        self._twist = None if e.twist is None else e.twist[0]
        self._pairs = [(self._p + 2 * pair, i, j) for pair, (i, j) in enumerate(PAIRS[: self._p * (self._p - 1) // 2])]

    def of_responses(self, by_number: F64) -> F32:
        """(b, 2 p s, m + 2, r) changes of the responses with each column of by_number (5, q, r): by way, real or
        imaginary part, and sensor.
        """
        moving = np.flatnonzero(by_number.any(axis=(0, 2)))
        n_first = int(moving.max(initial=-1)) + 1
        if 2 * len(moving) > n_first:
            moving = np.arange(n_first)
        slopes = self._e.motion.slopes(moving)[:, :, :, 0]
        q, p, s, levels, m = slopes.shape
        planes = buffer("planes", (levels, q, s, 2, p, m))
        by_level = slopes.transpose(3, 0, 2, 1, 4)
        planes[:, :, :, 0], planes[:, :, :, 1] = by_level.real, by_level.imag
        weights, r = self._g.weights.astype(np.float32), by_number.shape[-1]
        by_number = np.ascontiguousarray(by_number[:, moving], np.float32)
        moved = buffer("by_level", (levels, 2 * p * s * m, r))
        np.matmul(planes.reshape(levels, q, 2 * p * s * m).swapaxes(1, 2), by_number, out=moved)
        found = buffer("of_responses", (len(weights), 2 * p * s * m * r))
        np.matmul(weights, moved.reshape(levels, 2 * p * s * m * r), out=found)
        return found.reshape(len(weights), 2 * p * s, m, r)

    def by_response(self) -> F32:
        """Derivatives of the parts by the responses, in the order of ``of_responses``: (b, m + 2, p^2, 2 p s).

        An auto-spectrum is F^* (slack F + phase R) plus terms without F, so a change d of the response F moves it by 2
        Re(conj(slack F + phase R) d), and likewise the others: each is the real part of a product with conj(z), or
        Re(z) Re(d) + Im(z) Im(d), with one z in the cross-spectra with others and one in its own power.
        """
        paths, p, s = self._paths, self._p, self._s
        whole = np.empty((2, *paths.shape), complex)
        beside, own = whole
        np.add(paths[:, ::2], self._late, out=beside[:, ::2])
        np.multiply(np.conj(self._phase), paths[:, ::2], out=beside[:, 1::2])
        beside[:, 1::2] += paths[:, 1::2]
        np.multiply(self._e.slack[:, None, 0], paths, out=own)
        own += beside
        own *= 2.0
        whole *= self._g.road
        if self._twist is not None:
            whole[:, :, 2:] *= self._twist
        planes = np.array([whole.real, whole.imag], np.float32).reshape(4 * p * s, -1)
        return (planes.T @ _of_planes(p, s)).reshape(*self._phase.shape, p * p, 2 * p * s)

    def by_road(self, entry: int) -> F64:
        """(p^2, b, m + 2) by the delay of the rear axle, which turns its phase, by the distance of its track from the
        front's, which reduces it, or by the twist of the tracks.
        """
        e, g = self._e, self._g
        if entry in (TRACKS_APART, TWIST_LEVEL):
            assert self._twist is not None
            by_twist = self._twist
            if entry == TRACKS_APART:  # d((1 - c)/(1 + c))/dc = -2 / (1 + c)^2
                x = e.log_turns(TRACKS_APART)[0]
                by_twist = e.of(TWIST_LEVEL)[0] * -2.0 * coherence_slope_of(x) / (1.0 + coherence_of(x)) ** 2
            return np.asarray(e.by_track[:, 1, 0] * (by_twist * g.road))
        if entry == TRACK_OFFSET:
            by_log = coherence_slope_of(e.log_turns(TRACK_OFFSET)[0])
            return np.asarray(self._by_late[0] * (by_log / e.coherence[0] * g.road))
        late_s = g.delay_s if entry == DELAY_SCALE else 1.0
        return np.asarray(self._by_late[1] * (g.at.omega * g.road * late_s))

    @cached_property
    def _by_late(self) -> tuple[F64, F64]:
        """(p^2, b, m + 2) by the logarithm of the rear axle's delayed response, and by -j times it; without road."""
        front = np.conj(self._paths[:, ::2])
        plain, turned = np.empty((2, self._p**2, *front.shape[1:]))
        auto = self._late * front
        np.multiply(auto.real, 2.0, out=plain[: self._p])
        np.multiply(auto.imag, 2.0, out=turned[: self._p])
        for re, i, j in self._pairs:
            one, other = self._late[i] * front[j], np.conj(self._late[j] * front[i])
            both, apart = one + other, one - other
            plain[re], plain[re + 1], turned[re], turned[re + 1] = both.real, both.imag, apart.imag, -apart.real
        if self._twist is None:
            return plain[:, 0], turned[:, 0]
        return plain[:, 0] + self._twist * plain[:, 1], turned[:, 0] + self._twist * turned[:, 1]

    def local(self) -> F64:
        """(p, 11, b, m) see Slopes."""
        e, hats = self._e, self._g.hats
        own = e.of_tracks(e.own)[:, 0] * e.slack_above[:, 0] * self._g.road
        found = np.empty((len(own), len(hats) + 1, own.shape[1], own.shape[2] - 2))
        found[:, :-1] = tapered(own[:, None] * hats[:, None])
        found[:, -1] = (e.density * e.scale)[:, 0]
        return found


@cache
def _of_planes(p: int, s: int) -> F32:
    """The matrix (4 p s, p^2 2 p s) of _Chain.by_response, which turns factors into slopes by each response.

    Its rows are the real parts of the factors that stand beside a response in the cross-spectra, those of the factors
    in its own power, then their imaginary parts.
    """
    found = np.zeros((2, 2, p, p * p, 2, p))
    (beside_re, own_re), (beside_im, own_im) = found
    for i in range(p):
        own_re[i, i, 0, i] = own_im[i, i, 1, i] = 1.0
    for pair, (i, j) in enumerate(PAIRS[: p * (p - 1) // 2]):
        re, im = p + 2 * pair, p + 2 * pair + 1
        for one, other, sign in ((i, j, 1.0), (j, i, -1.0)):
            beside_re[other, re, 0, one] = beside_im[other, re, 1, one] = 1.0
            beside_im[other, im, 0, one], beside_re[other, im, 1, one] = -sign, sign
    every = np.zeros((4 * p, s, p * p, s, 2 * p), np.float32)
    every[:, range(s), :, range(s)] = found.reshape(4 * p, p * p, 2 * p)
    return every.reshape(4 * p * s, -1)
