"""Unevenness of a road: rougher and smoother stretches, potholes, speed humps."""

import math
from dataclasses import dataclass

import numpy as np

from gateway.records import F64
from gateway.sim.road import Road, RoadRecipe


@dataclass(frozen=True, slots=True)
class UnevenRoad:
    """A recipe whose roughness differs from stretch to stretch.

    Stretches have exponential lengths of mean stretch_m; their height gain is log-normal with
    median 1 and log standard deviation spread; gains change over blend_m.
    """

    recipe: RoadRecipe
    stretch_m: float = 400.0
    spread: float = 0.35
    blend_m: float = 10.0

    def lay(self, length_m: float, rng: np.random.Generator) -> Road:
        road = self.recipe.lay(length_m, rng)
        ends = [0.0]
        while ends[-1] < road.length_m:
            ends.append(ends[-1] + 2.0 * self.blend_m + rng.exponential(self.stretch_m))
        gains = np.exp(self.spread * rng.standard_normal(len(ends)))
        along = np.arange(len(road.left_m)) * road.step_m
        knots = np.repeat(ends, 2)[1:] + np.tile([-0.5, 0.5], len(ends))[1:] * self.blend_m
        gain = np.interp(along, knots, np.repeat(gains, 2)[:-1])
        return Road(road.step_m, road.left_m * gain, road.right_m * gain)


@dataclass(frozen=True, slots=True)
class Bump:
    """A raised cosine of height_m (negative: a pothole) and length_m, its middle at position_m, under some wheels."""

    position_m: float
    length_m: float
    height_m: float
    is_left: bool = True
    is_right: bool = True


@dataclass(frozen=True, slots=True)
class ObstacleRoad:
    """A recipe strewn with potholes (one track each) and speed humps (both), at random places."""

    recipe: RoadRecipe
    potholes_per_km: float = 2.0
    humps_per_km: float = 0.0
    pothole_m: tuple[float, float] = (0.5, 0.03)  # length, depth
    hump_m: tuple[float, float] = (3.7, 0.08)  # length, height

    def lay(self, length_m: float, rng: np.random.Generator) -> Road:
        road = self.recipe.lay(length_m, rng)
        n_potholes, n_humps = rng.poisson(np.array([self.potholes_per_km, self.humps_per_km]) * length_m / 1000.0)
        potholes = [self._pothole(rng.uniform(0.0, length_m), rng) for _ in range(n_potholes)]
        humps = [Bump(rng.uniform(0.0, length_m), *self.hump_m) for _ in range(n_humps)]
        return with_bumps(road, potholes + humps)

    def _pothole(self, position_m: float, rng: np.random.Generator) -> Bump:
        length_m, depth_m = self.pothole_m
        is_left = bool(rng.random() < 0.5)
        return Bump(position_m, length_m, -depth_m * rng.uniform(0.4, 1.6), is_left, not is_left)


def with_bumps(road: Road, bumps: list[Bump]) -> Road:
    """The road with each bump added to the tracks it lies on."""
    left, right = road.left_m.copy(), road.right_m.copy()
    for bump in bumps:
        where, shape = _shape(bump, road)
        if bump.is_left:
            left[where] += shape
        if bump.is_right:
            right[where] += shape
    return Road(road.step_m, left, right)


def _shape(bump: Bump, road: Road) -> tuple[slice, F64]:
    """The samples that a bump covers, and its heights there."""
    half = bump.length_m / 2.0
    first = max(math.ceil((bump.position_m - half) / road.step_m), 0)
    last = min(math.floor((bump.position_m + half) / road.step_m), len(road.left_m) - 1)
    place = np.arange(first, last + 1) * road.step_m - bump.position_m
    return slice(first, last + 1), bump.height_m * 0.5 * (1.0 + np.cos(math.pi * place / half))
