"""/api/v1/weights/latest: gross weight and axle loads of the latest estimate, and whether they are too much."""

import math
from collections.abc import Sequence

from fastapi import APIRouter
from pydantic import BaseModel, Field

from gateway.core.calibrated import CalibratedVehicle
from gateway.core.vehicle import Vehicle
from gateway.core.weights import Place, Weights, is_over_limit, place_of, weights_of
from gateway.estimate import Quantity
from gateway.records import iso_utc
from gateway.web.live.board import Board


class WeightFigure(BaseModel):
    """One weight; null is unknown. ``is_over_limit`` begins above the limit and ends 3 % below it."""

    kg: float | None = Field(examples=[1894.2])
    std_kg: float | None = Field(examples=[6.1])
    limit_kg: float | None = Field(examples=[2100.0])
    is_over_limit: bool = Field(examples=[False])


class LoadPlace(BaseModel):
    """The payload's centre of gravity, behind the front axle."""

    position_m: float = Field(examples=[1.3])
    std_m: float = Field(examples=[0.08])


class LatestWeights(BaseModel):
    """Static weights, unsprung masses included, of the estimate that ``/estimates/latest`` shows."""

    id: str | None = Field(description="of the estimate")
    t_end: str | None
    age_s: float | None
    is_stale: bool
    gross: WeightFigure
    front_axle: WeightFigure
    rear_axle: WeightFigure
    load: LoadPlace | None = Field(description="null: unknown, or no payload that is surely there")


class Scales:
    """Weights of estimates as they are sent: of this vehicle, unknown where nothing is known of it."""

    def __init__(self, calibrated: CalibratedVehicle | None) -> None:
        self.vehicle: Vehicle | None = None if calibrated is None else calibrated.vehicle

    def weigh(self, payload: Quantity, front_share: Quantity, correlation: float = math.nan) -> Weights | None:
        """Weights with such a payload; None without an answer or without figures of the vehicle."""
        if self.vehicle is None or math.isnan(payload.number) or math.isnan(front_share.number):
            return None
        return weights_of(self.vehicle, payload, front_share, correlation)

    def place(self, payload: Quantity, front_share: Quantity, correlation: float = math.nan) -> Place | None:
        """Where such a payload lies; None where that cannot be told."""
        numbers = (payload.number, payload.std, front_share.number, front_share.std)
        if self.vehicle is None or any(map(math.isnan, numbers)):
            return None
        return place_of(self.vehicle, payload, front_share, correlation)

    def limits_kg(self) -> dict[str, float | None]:
        """The limits that were stated for this vehicle."""
        v = self.vehicle
        return {
            "gross": None if v is None else v.gross_limit_kg,
            "front_axle": None if v is None else v.front_axle_limit_kg,
            "rear_axle": None if v is None else v.rear_axle_limit_kg,
        }


def weights_router(board: Board, scales: Scales) -> APIRouter:
    """The route that tells weights."""
    router = APIRouter(prefix="/api/v1", tags=["vehicle"])

    @router.get("/weights/latest")
    async def latest_weights() -> LatestWeights:
        """Gross weight and axle loads in kg, with standard deviation, limit and warning."""
        return weigh_latest(board, scales)

    return router


def weigh_latest(board: Board, scales: Scales) -> LatestWeights:
    """Weights of the estimate shown now; the warnings look back over the last estimates."""
    shown = board.shown()
    weighed = (scales.weigh(past.payload, past.front_share, past.correlation) for past in board.recent_estimates())
    history = [weights for weights in weighed if weights is not None]
    told = (shown.payload, shown.front_share, shown.correlation)
    now, place = scales.weigh(*told), scales.place(*told)
    limits = scales.limits_kg()
    return LatestWeights(
        id=None if shown.estimate is None else shown.estimate.id,
        t_end=None if shown.estimate is None else iso_utc(shown.estimate.t_end_ns),
        age_s=shown.age_s,
        is_stale=shown.is_stale,
        gross=_figure(now, history, "gross", limits["gross"]),
        front_axle=_figure(now, history, "front_axle", limits["front_axle"]),
        rear_axle=_figure(now, history, "rear_axle", limits["rear_axle"]),
        load=None if place is None else LoadPlace(position_m=round(place.position_m, 3), std_m=round(place.std_m, 3)),
    )


def _figure(now: Weights | None, history: Sequence[Weights], name: str, limit_kg: float | None) -> WeightFigure:
    return WeightFigure(
        kg=None if now is None else _or_none(getattr(now, name).kg),
        std_kg=None if now is None else _or_none(getattr(now, name).std_kg),
        limit_kg=limit_kg,
        is_over_limit=is_over_limit((getattr(weights, name).kg for weights in history), limit_kg),
    )


def _or_none(x: float) -> float | None:
    return round(x, 3) if math.isfinite(x) else None
