"""/api/v1/vss: the vehicle in the words of the COVESA Vehicle Signal Specification and our overlay to it."""

import math
from collections.abc import Callable
from typing import Final

from fastapi import APIRouter
from pydantic import BaseModel, Field

from gateway.core.weights import unsprung_kg
from gateway.web.live.board import Board, Shown
from gateway.web.routes.weights import LatestWeights, Scales, weigh_latest

_UINT16_LAST: Final = 65_535

OVERLAY: Final[dict[str, tuple[Callable[[Shown], float], str]]] = {  # described in docs/vss/springscale.vspec
    "Vehicle.Load.Payload": (lambda shown: shown.payload.number, "kg"),
    "Vehicle.Load.PayloadStd": (lambda shown: shown.payload.std, "kg"),
    "Vehicle.Load.FrontShare": (lambda shown: shown.front_share.number, "percent"),
    "Vehicle.Load.FrontShareStd": (lambda shown: shown.front_share.std, "percent"),
    "Vehicle.Load.LeftShare": (lambda shown: shown.left_share.number, "percent"),
    "Vehicle.Load.LeftShareStd": (lambda shown: shown.left_share.std, "percent"),
    "Vehicle.Load.CenterOfGravityLeft": (lambda shown: shown.cg_left.number, "m"),
    "Vehicle.Load.CenterOfGravityLeftStd": (lambda shown: shown.cg_left.std, "m"),
}
LOADS: Final = {  # likewise: the core has these branches and no load in them
    "Vehicle.Chassis.Axle.Row1": "front_axle",
    "Vehicle.Chassis.Axle.Row1.Wheel.Left": "front_left",
    "Vehicle.Chassis.Axle.Row1.Wheel.Right": "front_right",
    "Vehicle.Chassis.Axle.Row2": "rear_axle",
    "Vehicle.Chassis.Axle.Row2.Wheel.Left": "rear_left",
    "Vehicle.Chassis.Axle.Row2.Wheel.Right": "rear_right",
}


class VssPoint(BaseModel):
    """One VSS signal; value null is unknown."""

    path: str = Field(examples=["Vehicle.CurrentOverallWeight"])
    value: float | int | None = Field(examples=[1894])
    unit: str = Field(examples=["kg"])
    timestamp: str | None = Field(description="end of the batch", examples=["2026-11-21T03:55:00.000000Z"])


def vss_router(board: Board, scales: Scales) -> APIRouter:
    """The route that speaks VSS."""
    router = APIRouter(prefix="/api/v1", tags=["standards"])

    @router.get("/vss")
    async def vss() -> list[VssPoint]:
        """Core VSS paths and those of the Springscale overlay, of the latest estimate."""
        return vss_points(board, scales)

    return router


def vss_points(board: Board, scales: Scales) -> list[VssPoint]:
    """Every path we speak, in a fixed order."""
    weights, shown = weigh_latest(board, scales), board.shown()
    t_end = weights.t_end
    points = [
        VssPoint(path="Vehicle.CurrentOverallWeight", value=_uint16(weights.gross.kg), unit="kg", timestamp=t_end),
        VssPoint(path="Vehicle.CurbWeight", value=_uint16(_kerb_kg(scales)), unit="kg", timestamp=None),
        VssPoint(path="Vehicle.GrossWeight", value=_uint16(weights.gross.limit_kg), unit="kg", timestamp=None),
    ]
    points += [
        VssPoint(path=path, value=_or_none(number_of(shown)), unit=unit, timestamp=t_end)
        for path, (number_of, unit) in OVERLAY.items()
    ]
    for path, place in LOADS.items():
        points += _load(path, place, weights)
    return points


def _load(path: str, place: str, weights: LatestWeights) -> list[VssPoint]:
    figure = getattr(weights, place)
    return [
        VssPoint(path=f"{path}.Load", value=figure.kg, unit="kg", timestamp=weights.t_end),
        VssPoint(path=f"{path}.LoadStd", value=figure.std_kg, unit="kg", timestamp=weights.t_end),
    ]


def _kerb_kg(scales: Scales) -> float | None:
    if scales.vehicle is None:
        return None
    kerb_kg = scales.vehicle.empty_mass_kg + sum(unsprung_kg(scales.vehicle))
    return kerb_kg if math.isfinite(kerb_kg) else None


def _or_none(x: float) -> float | None:
    return x if math.isfinite(x) else None


def _uint16(kg: float | None) -> int | None:
    """VSS gives these the type uint16."""
    return None if kg is None else min(max(round(kg), 0), _UINT16_LAST)
