"""/api/v1/weights/latest and /vss: gross weight, axle and wheel loads of the latest estimate, whether they are too
much, the same in the terms of the COVESA Vehicle Signal Specification, and the actual load where it is known.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Final

from fastapi import APIRouter
from pydantic import BaseModel, Field

from gateway.core.vehicle import Vehicle
from gateway.core.weights.on_the_road import unsprung_kg
from gateway.estimates.field_kinds import WEIGHTS
from gateway.estimates.quantities import QUANTITIES
from gateway.records import iso_utc, rounded
from gateway.stated.facts import Instant
from gateway.status import Status
from gateway.web.live.board import Board
from gateway.web.routes.present_load import NOT_WEIGHED, Scales, VerdictTold
from gateway.web.schemas import WeightFigures


class LoadPlace(BaseModel):
    """The payload's centre of gravity, behind the front axle and left of the centre line."""

    position_m: float = Field(examples=[1.3])
    std_m: float = Field(examples=[0.08])
    left_m: float | None = Field(description="null: nothing tells", examples=[0.12])
    left_std_m: float | None = Field(examples=[0.03])
    correlation: float | None = Field(description="of both errors, -1 to 1", examples=[0.1])


class LatestWeights(WeightFigures):
    """Static weights, unsprung masses included, of the estimate that ``/estimates/latest`` shows, and its age.

    ``is_over_limit`` is of this estimate alone; ``verdict`` counts all batches of the load and the alarms, and is what
    pages show.
    """

    id: str | None = Field(description="of the estimate")
    t_end: str | None
    age_s: float | None
    is_stale: bool
    load: LoadPlace | None = Field(description="null: unknown, or no payload that is surely there")
    verdict: VerdictTold


def weights_router(board: Board, scales: Scales, status: Callable[[], Status]) -> APIRouter:
    router = APIRouter(prefix="/api/v1", tags=["vehicle"])

    @router.get("/weights/latest")
    async def latest_weights() -> LatestWeights:
        """Gross weight, axle and wheel loads in kg, with standard deviation and limit, and the verdict on them."""
        shown = board.shown()
        estimate, place = shown.estimate, scales.place(shown.estimate)
        return LatestWeights(
            id=None if estimate is None else estimate.id,
            t_end=None if estimate is None else iso_utc(estimate.t_end_ns),
            age_s=shown.age_s,
            is_stale=shown.is_stale,
            load=None if place is None else LoadPlace(**{name: rounded(x, 3) for name, x in asdict(place).items()}),
            verdict=scales.present_load(board, status()).told(),
            **WEIGHTS.write(scales.weigh(estimate)),
        )

    return router


_UINT16_LAST: Final = 65_535  # the greatest number of 16 bits


class VssPoint(BaseModel):
    """One VSS signal; value null is unknown."""

    path: str = Field(examples=["Vehicle.CurrentOverallWeight"])
    value: float | int | None = Field(examples=[1894])
    unit: str = Field(examples=["kg"])
    timestamp: str | None = Field(description="end of the batch", examples=["2026-11-21T03:55:00.000000Z"])


def standards_router(board: Board, scales: Scales) -> APIRouter:
    """The weights in the terms of VSS."""
    router = APIRouter(prefix="/api/v1", tags=["standards"])

    @router.get("/vss")
    async def vss() -> list[VssPoint]:
        """The weights of the latest estimate by VSS paths: those of its core, and others of that form."""
        return vss_points(board, scales)

    return router


def vss_points(board: Board, scales: Scales) -> list[VssPoint]:
    """Every VSS path that we support, in a fixed order."""
    estimate = board.shown().estimate
    weights, t_end = scales.weigh(estimate), None if estimate is None else iso_utc(estimate.t_end_ns)
    points = [
        VssPoint(path="Vehicle.CurbWeight", value=_uint16(_kerb_kg(scales.vehicle)), unit="kg", timestamp=None),
        VssPoint(path="Vehicle.GrossWeight", value=_uint16(weights.gross.limit_kg), unit="kg", timestamp=None),
    ]
    for one in QUANTITIES:
        figure = getattr(weights if one.is_weight else estimate or NOT_WEIGHED, one.name)
        known, std = (figure.kg, figure.std_kg) if one.is_weight else (figure.number, figure.std)
        found: dict[str, float | None] = {one.vss: _uint16(known)}
        if one.has_vss_std:
            found = {one.vss: rounded(known, 3), f"{one.vss}Std": rounded(std, 3)}
        points += [VssPoint(path=path, value=x, unit=one.vss_unit, timestamp=t_end) for path, x in found.items()]
    return points


def _kerb_kg(vehicle: Vehicle | None) -> float | None:
    return None if vehicle is None else vehicle.empty_mass_kg + sum(unsprung_kg(vehicle))


def _uint16(kg: float | None) -> int | None:
    """VSS gives these the type uint16."""
    return None if kg is None or not math.isfinite(kg) else min(max(round(kg), 0), _UINT16_LAST)


KNOWN_LOADS_PATH: Final = "/api/v1/known-loads"


class KnownLoadTold(BaseModel):
    """A known load: it is aboard from ``t_start`` on, until the next."""

    t_start: Instant
    payload_kg: float
    front_share_pct: float


KnownLoads = Callable[[], Sequence[KnownLoadTold]]


class KnownLoadsTold(BaseModel):
    """Known loads in order of time, for comparison only: no estimate uses them."""

    items: list[KnownLoadTold]


def known_loads_router(known_loads: KnownLoads) -> APIRouter:
    """The route of known loads; a service on the road has none."""
    router = APIRouter(tags=["api"])

    @router.get(KNOWN_LOADS_PATH)
    async def told() -> KnownLoadsTold:
        """The actual load, as the simulator of the demonstration knows it."""
        return KnownLoadsTold(items=list(known_loads()))

    return router
