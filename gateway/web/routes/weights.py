"""/api/v1/weights/latest and /vss: gross weight, axle and wheel loads of the latest estimate, whether they are too
much, the same in the terms of the COVESA Vehicle Signal Specification, and the actual load where it is known.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any, Final

from fastapi import APIRouter
from pydantic import BaseModel, Field

from gateway.core.vehicle import Vehicle
from gateway.core.weights.limits import is_over_limit
from gateway.core.weights.on_the_road import NOT_CALIBRATED, PayloadPlace, place_of, unsprung_kg, weighed
from gateway.estimates.batch_estimate import Estimate, Weight, Weights
from gateway.estimates.quantities import QUANTITIES
from gateway.records import iso_utc, rounded
from gateway.stated.facts import Instant
from gateway.status import Status
from gateway.web.live.board import Board, Shown
from gateway.web.routes.present_verdict import VerdictTold, present_load
from gateway.web.schemas import WeightFigure, WeightFigures
from gateway.weighing.calibrated import CalibratedVehicle

_NONE: Final = Estimate(0, 0, "")


class LoadPlace(BaseModel):
    """The payload's centre of gravity, behind the front axle and left of the centre line."""

    position_m: float = Field(examples=[1.3])
    std_m: float = Field(examples=[0.08])
    left_m: float | None = Field(description="null: nothing tells", examples=[0.12])
    left_std_m: float | None = Field(examples=[0.03])
    correlation: float | None = Field(description="of both errors, -1 to 1", examples=[0.1])


class WeighedWhen(BaseModel):
    """The estimate that the weights belong to, and its age."""

    id: str | None = Field(description="of the estimate")
    t_end: str | None
    age_s: float | None
    is_stale: bool


class LatestWeights(WeightFigures, WeighedWhen):
    """Static weights, unsprung masses included, of the estimate that ``/estimates/latest`` shows.

    ``is_over_limit`` begins above the limit and ends 3 % below it, looking back over the last estimates; ``verdict`` is
    what pages show.
    """

    load: LoadPlace | None = Field(description="null: unknown, or no payload that is surely there")


class Scales:
    """Weights of estimates as they are sent: of this vehicle, unknown if its figures are."""

    def __init__(self, calibrated: CalibratedVehicle | None) -> None:
        self.vehicle: Vehicle | None = None if calibrated is None else calibrated.vehicle
        self._unsprung = NOT_CALIBRATED if calibrated is None else calibrated.unsprung
        self._known: dict[int, tuple[Estimate, Weights]] = {}  # by identity: the estimates are kept with them

    def weigh(self, estimate: Estimate | None) -> Weights:
        """Weighs an estimate by the vehicle's present figures, not by those it was stored with; None: nothing was
        weighed yet."""
        return weighed(estimate or _NONE, self.vehicle, self._unsprung).weights

    def weigh_each(self, estimates: Sequence[Estimate]) -> list[Weights]:
        """Weighs many estimates, each once however often it is requested. May be called from any thread."""
        known, found = self._known, dict[int, tuple[Estimate, Weights]]()
        for one in estimates:
            if id(one) not in found:
                found[id(one)] = known.get(id(one)) or (one, self.weigh(one))
        self._known = found
        return [found[id(one)][1] for one in estimates]

    def place(self, estimate: Estimate | None) -> PayloadPlace | None:
        """The position of its payload; None if unknown."""
        if self.vehicle is None or estimate is None or estimate.posterior is None:
            return None
        return place_of(self.vehicle, estimate.posterior)


class JudgedWeights(LatestWeights):
    """The weights with the verdict on the present load, which counts all its batches and the alarms."""

    verdict: VerdictTold


def weights_router(board: Board, scales: Scales, status: Callable[[], Status]) -> APIRouter:
    router = APIRouter(prefix="/api/v1", tags=["vehicle"])

    @router.get("/weights/latest")
    async def latest_weights() -> JudgedWeights:
        """Gross weight, axle and wheel loads in kg, with standard deviation and limit, and the verdict on them."""
        verdict = present_load(board, scales.weigh, status(), scales.vehicle).told()
        return JudgedWeights(**weigh_latest(board, scales).model_dump(), verdict=verdict)

    return router


def weigh_latest(board: Board, scales: Scales) -> LatestWeights:
    """Weights of the estimate shown now; the warnings look back over the last estimates."""
    shown = board.shown()
    *history, now = scales.weigh_each([*board.recent_estimates(), shown.estimate or _NONE])
    figures = {
        place: _figure(weight, [getattr(weights, place).kg for weights in history]) for place, weight in now.items()
    }
    return LatestWeights(
        **_when(shown),
        load=_place(scales.place(shown.estimate)),
        **figures,
    )


def _when(shown: Shown) -> dict[str, Any]:
    """The fields of WeighedWhen."""
    estimate = shown.estimate
    return {
        "id": None if estimate is None else estimate.id,
        "t_end": None if estimate is None else iso_utc(estimate.t_end_ns),
        "age_s": shown.age_s,
        "is_stale": shown.is_stale,
    }


def _figure(now: Weight, history_kg: Sequence[float]) -> WeightFigure:
    return WeightFigure(
        kg=rounded(now.kg, 3),
        std_kg=rounded(now.std_kg, 3),
        limit_kg=now.limit_kg,
        is_over_limit=is_over_limit(history_kg, now.limit_kg),
        lacks=now.lacks,
        is_unsprung_estimated=now.is_unsprung_estimated,
    )


def _place(place: PayloadPlace | None) -> LoadPlace | None:
    return None if place is None else LoadPlace(**{name: rounded(x, 3) for name, x in asdict(place).items()})


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
    weights, estimate = weigh_latest(board, scales), board.shown().estimate or _NONE
    points = [
        VssPoint(path="Vehicle.CurbWeight", value=_uint16(_kerb_kg(scales)), unit="kg", timestamp=None),
        VssPoint(path="Vehicle.GrossWeight", value=_uint16(weights.gross.limit_kg), unit="kg", timestamp=None),
    ]
    for one in QUANTITIES:
        figure = getattr(weights if one.is_weight else estimate, one.name)
        known, std = (figure.kg, figure.std_kg) if one.is_weight else map(_finite, (figure.number, figure.std))
        found = {one.vss: known, f"{one.vss}Std": std} if one.has_vss_std else {one.vss: _uint16(known)}
        points += [
            VssPoint(path=path, value=value, unit=one.vss_unit, timestamp=weights.t_end)
            for path, value in found.items()
        ]
    return points


def _kerb_kg(scales: Scales) -> float | None:
    if scales.vehicle is None:
        return None
    return _finite(scales.vehicle.empty_mass_kg + sum(unsprung_kg(scales.vehicle)))


def _finite(x: float) -> float | None:
    return x if math.isfinite(x) else None


def _uint16(kg: float | None) -> int | None:
    """VSS gives these the type uint16."""
    return None if kg is None else min(max(round(kg), 0), _UINT16_LAST)


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
    """Their route; a service on the road has no known loads."""
    router = APIRouter(tags=["api"])

    @router.get(KNOWN_LOADS_PATH)
    async def told() -> KnownLoadsTold:
        """The actual load, as the simulator of the demonstration knows it."""
        return KnownLoadsTold(items=list(known_loads()))

    return router
