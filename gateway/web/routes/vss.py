"""/api/v1/vss: the vehicle in the words of the COVESA Vehicle Signal Specification and our overlay to it."""

import math
from typing import Final

from fastapi import APIRouter
from pydantic import BaseModel, Field

from gateway.core.weights import unsprung_kg
from gateway.quantities import QUANTITIES
from gateway.web.live.board import Board
from gateway.web.routes.weights import Scales, weigh_latest

_UINT16_LAST: Final = 65_535


class VssPoint(BaseModel):
    """One VSS signal; value null is unknown."""

    path: str = Field(examples=["Vehicle.CurrentOverallWeight"])
    value: float | int | None = Field(examples=[1894])
    unit: str = Field(examples=["kg"])
    timestamp: str | None = Field(description="end of the batch", examples=["2026-11-21T03:55:00.000000Z"])


def vss_router(board: Board, scales: Scales) -> APIRouter:
    """The route for VSS."""
    router = APIRouter(prefix="/api/v1", tags=["standards"])

    @router.get("/vss")
    async def vss() -> list[VssPoint]:
        """Core VSS paths and those of the Springscale overlay, of the latest estimate."""
        return vss_points(board, scales)

    return router


def vss_points(board: Board, scales: Scales) -> list[VssPoint]:
    """Every VSS path that we support, in a fixed order; docs/vss/springscale.vspec describes those of the overlay."""
    weights, shown = weigh_latest(board, scales), board.shown()
    points = [
        VssPoint(path="Vehicle.CurbWeight", value=_uint16(_kerb_kg(scales)), unit="kg", timestamp=None),
        VssPoint(path="Vehicle.GrossWeight", value=_uint16(weights.gross.limit_kg), unit="kg", timestamp=None),
    ]
    for one in QUANTITIES:
        figure = getattr(weights if one.is_weight else shown, one.name)
        known, std = (figure.kg, figure.std_kg) if one.is_weight else (_or_none(figure.number), _or_none(figure.std))
        found = {one.vss: known, f"{one.vss}Std": std} if one.has_vss_std else {one.vss: _uint16(known)}
        points += [
            VssPoint(path=path, value=value, unit=one.vss_unit, timestamp=weights.t_end)
            for path, value in found.items()
        ]
    return points


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
