"""/api/v1/vehicle and /api/v1/spectra/latest: what is known of the vehicle, and what its springs say."""

from collections.abc import Callable

from fastapi import APIRouter
from pydantic import BaseModel, Field
from starlette.responses import Response

from gateway.core.calibrated import CalibratedVehicle
from gateway.core.ratio_index import Band as RatioBand
from gateway.records import json_line
from gateway.web.board import Board
from gateway.web.schemas import Spectra
from gateway.web.status import SignalHealth, Status


class VehicleFigures(BaseModel):
    """The vehicle as its calibration campaign stated it. Masses and share are of the sprung mass; unknown is null."""

    name: str
    empty_mass_kg: float
    wheelbase_m: float
    empty_front_share_pct: float
    unsprung_front_kg: float | None
    unsprung_rear_kg: float | None
    kerb_front_axle_kg: float | None
    kerb_rear_axle_kg: float | None
    front_axle_limit_kg: float | None
    rear_axle_limit_kg: float | None
    gross_limit_kg: float | None


class CalibrationFigures(BaseModel):
    """The calibration in use and the loads it saw: the ranges in which answers are trusted."""

    id: str
    payload_seen_kg: tuple[float, float]
    front_share_seen_pct: tuple[float, float]


class VehicleDescription(BaseModel):
    """Who the vehicle is, how it is calibrated, how its signals are."""

    vehicle_id: str | None
    vin: str | None
    estimator: str | None
    calibration: CalibrationFigures | None = Field(description="null: not calibrated, no payload can be told")
    figures: VehicleFigures | None
    signals: tuple[SignalHealth, ...]


class BandHz(BaseModel):
    """A band of a ratio index."""

    centre_hz: float
    width_hz: float


class LatestSpectra(BaseModel):
    """Spectra of the last batch, answered or not; nulls before the first."""

    id: str | None
    t_start: str | None
    t_end: str | None
    rejected: list[str]
    spectra: Spectra | None
    acceleration_bands: list[BandHz] | None = Field(description="ratio index: numerator and denominator")
    pitch_rate_bands: list[BandHz] | None = Field(description="ratio index: numerator and denominator")


def vehicle_router(board: Board, status: Callable[[], Status], calibrated: CalibratedVehicle | None) -> APIRouter:
    """The routes about the vehicle itself; ``calibrated`` is what the service estimates with."""
    router = APIRouter(prefix="/api/v1", tags=["vehicle"])
    bands = _bands(calibrated)

    @router.get("/vehicle")
    async def vehicle() -> VehicleDescription:
        """Who the vehicle is, its calibration and ranges, the health of its signals."""
        now = status()
        return VehicleDescription(
            vehicle_id=now.vehicle_id,
            vin=now.vin,
            estimator=now.estimator,
            calibration=None if calibrated is None else _calibration(calibrated),
            figures=None if calibrated is None else _figures(calibrated),
            signals=now.signals,
        )

    @router.get("/spectra/latest", response_model=LatestSpectra)
    async def latest_spectra() -> Response:
        """Auto- and cross-spectra of the last batch, with the bands the ratio index reads."""
        return Response(json_line({**board.latest_spectra(), **bands}), media_type="application/json")

    return router


def _calibration(calibrated: CalibratedVehicle) -> CalibrationFigures:
    return CalibrationFigures(
        id=calibrated.id,
        payload_seen_kg=calibrated.payload_seen_kg,
        front_share_seen_pct=calibrated.front_share_seen_pct,
    )


def _figures(calibrated: CalibratedVehicle) -> VehicleFigures:
    return VehicleFigures(**{name: getattr(calibrated.vehicle, name) for name in VehicleFigures.model_fields})


def _bands(calibrated: CalibratedVehicle | None) -> dict[str, list[dict[str, float]] | None]:
    index = None if calibrated is None else calibrated.ratio_index
    return {
        "acceleration_bands": None if index is None else _pair(index.acceleration_bands),
        "pitch_rate_bands": None if index is None else _pair(index.pitch_rate_bands),
    }


def _pair(bands: tuple[RatioBand, RatioBand] | None) -> list[dict[str, float]] | None:
    return None if bands is None else [{"centre_hz": b.centre_hz, "width_hz": b.width_hz} for b in bands]
