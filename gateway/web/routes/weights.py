"""/api/v1/weights/latest: gross weight, axle and wheel loads of the latest estimate, and whether they are too much."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Final

from fastapi import APIRouter
from pydantic import BaseModel, Field

from gateway.core.calibrated import CalibratedVehicle
from gateway.core.vehicle import Vehicle
from gateway.core.weights import NOT_CALIBRATED, PayloadPlace, is_over_limit, place_of, weighed
from gateway.estimate import Estimate, Weight, Weights
from gateway.records import iso_utc
from gateway.web.live.board import Board
from gateway.web.schemas import WeightFigure, WeightFigures

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

    ``is_over_limit`` begins above the limit and ends 3 % below it, looking back over the last estimates.
    """

    load: LoadPlace | None = Field(description="null: unknown, or no payload that is surely there")


class Scales:
    """Weights of estimates as they are sent: of this vehicle, unknown if its figures are."""

    def __init__(self, calibrated: CalibratedVehicle | None) -> None:
        self.vehicle: Vehicle | None = None if calibrated is None else calibrated.vehicle
        self._unsprung = NOT_CALIBRATED if calibrated is None else calibrated.unsprung
        self._known: dict[int, tuple[Estimate, Weights]] = {}  # by identity: the estimates are kept with them

    def weigh(self, estimate: Estimate | None) -> Weights:
        """By this vehicle's present figures, not those that the estimate was stored with; None: before the first."""
        return weighed(estimate or _NONE, self.vehicle, self._unsprung).weights

    def weigh_each(self, estimates: Sequence[Estimate]) -> list[Weights]:
        """The same for many, each computed once however often it is requested. From any thread."""
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


def weights_router(board: Board, scales: Scales) -> APIRouter:
    """The route of weights."""
    router = APIRouter(prefix="/api/v1", tags=["vehicle"])

    @router.get("/weights/latest")
    async def latest_weights() -> LatestWeights:
        """Gross weight, axle and wheel loads in kg, with standard deviation, limit and warning."""
        return weigh_latest(board, scales)

    return router


def weigh_latest(board: Board, scales: Scales) -> LatestWeights:
    """Weights of the estimate shown now; the warnings look back over the last estimates."""
    shown = board.shown()
    *history, now = scales.weigh_each([*board.recent_estimates(), shown.estimate or _NONE])
    figures = {
        place: _figure(weight, [getattr(weights, place).kg for weights in history]) for place, weight in now.items()
    }
    return LatestWeights(
        id=None if shown.estimate is None else shown.estimate.id,
        t_end=None if shown.estimate is None else iso_utc(shown.estimate.t_end_ns),
        age_s=shown.age_s,
        is_stale=shown.is_stale,
        load=_place(scales.place(shown.estimate)),
        **figures,
    )


def _figure(now: Weight, history_kg: Sequence[float]) -> WeightFigure:
    return WeightFigure(
        kg=_or_none(now.kg),
        std_kg=_or_none(now.std_kg),
        limit_kg=now.limit_kg,
        is_over_limit=is_over_limit(history_kg, now.limit_kg),
        lacks=now.lacks,
        is_unsprung_estimated=now.is_unsprung_estimated,
    )


def _place(place: PayloadPlace | None) -> LoadPlace | None:
    return None if place is None else LoadPlace(**{name: _or_none(x) for name, x in asdict(place).items()})


def _or_none(x: float) -> float | None:
    return round(x, 3) if math.isfinite(x) else None
