"""/api/v1/spectra/latest: what the springs said in the last batch, and what the fitted vehicle should have said."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from fastapi import APIRouter
from pydantic import BaseModel, Field
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response

from gateway.core.calibrated import CalibratedVehicle
from gateway.core.cross_spectrum.displayed import Fitted, modelled_spectra
from gateway.core.ratio_index.index import Band
from gateway.estimate_json import spectra_from_json, spectra_to_json
from gateway.records import Spectra as SpectraSeen
from gateway.records import json_line
from gateway.web.live.board import Board, Record
from gateway.web.schemas import Spectra

HEAD = ("id", "t_start", "t_end", "estimator", "rejected", "payload_kg", "front_share_pct")


class BandHz(BaseModel):
    """A band of a ratio index."""

    centre_hz: float = Field(examples=[2.4])
    width_hz: float = Field(examples=[0.05])


class LatestSpectra(BaseModel):
    """Spectra of the last batch, answered or not; nulls before the first.

    The cross-spectrum of pitch rate and acceleration is sqrt(coherence) times both amplitudes, turned by phase_rad.
    """

    id: str | None
    t_start: str | None = Field(json_schema_extra={"format": "date-time"}, examples=["2026-11-21T03:50:00.000000Z"])
    t_end: str | None = Field(json_schema_extra={"format": "date-time"}, examples=["2026-11-21T03:55:00.000000Z"])
    estimator: str | None = Field(examples=["cross_spectrum"])
    rejected: list[str] = Field(examples=[[]])
    payload_kg: float | None = Field(
        description="as weighed; the model carries it, and a tare that was taken off", examples=[271.3]
    )
    front_share_pct: float | None = Field(examples=[50.4])
    spectra: Spectra | None = Field(description="as measured")
    model: Spectra | None = Field(
        description="of the calibrated vehicle with this payload and share; null where the estimator has no such "
        "model or the batch no answer. Its frequencies are those that calibration used"
    )
    acceleration_bands: list[BandHz] | None = Field(description="ratio index: numerator and denominator")
    pitch_rate_bands: list[BandHz] | None = Field(description="ratio index: numerator and denominator")


def spectra_router(board: Board, calibrated: CalibratedVehicle | None) -> APIRouter:
    """The route of the spectra; ``calibrated`` is what the service estimates with."""
    router = APIRouter(prefix="/api/v1", tags=["vehicle"])
    bands = _bands(calibrated)
    modelled: dict[str | None, Any] = {}  # of the last batch asked for

    @router.get("/spectra/latest", response_model=LatestSpectra)
    async def latest_spectra() -> Response:
        """Auto- and cross-spectra of the last batch, the fitted model's beside them, and the ratio index's bands."""
        heard = board.heard()
        identity = heard["id"]
        if identity not in modelled:
            found = await run_in_threadpool(modelled_of, heard, calibrated)
            modelled.clear()
            modelled[identity] = found
        else:
            found = modelled[identity]
        told = {name: heard[name] for name in HEAD}
        shown = {"spectra": heard.get("spectra"), "model": found}
        return Response(json_line({**told, **shown, **bands}), media_type="application/json")

    return router


def modelled_of(record: Record, calibrated: CalibratedVehicle | None) -> dict[str, list[float | None]] | None:
    """The fitted model's spectra for one record; None where there is no model, no answer or no spectrum."""
    cross_spectrum = None if calibrated is None else calibrated.cross_spectrum
    spectra = record.get("spectra")
    if cross_spectrum is None or spectra is None or record["estimator"] != "cross_spectrum":
        return None
    if calibrated is not None and record["calibration_id"] != calibrated.id:
        return None  # weighed with an earlier calibration
    fitted = _fitted(record, cross_spectrum.wheelbase_m)
    seen = spectra_from_json(spectra)
    if fitted is None or not _is_whole(seen):
        return None
    return spectra_to_json(modelled_spectra(seen, cross_spectrum, fitted))


def _fitted(record: Record, wheelbase_m: float) -> Fitted | None:
    """What the estimator told of its fit; the delay of the mean speed where it told none."""
    told: Mapping[str, float | None] = record["diagnostics"]
    payload_kg = record.get("raw_payload_kg", record["payload_kg"])  # raw: before a tare was taken off
    front_share_pct = record.get("raw_front_share_pct", record["front_share_pct"])
    if payload_kg is None or front_share_pct is None or not record["mean_speed_mps"]:
        return None
    return Fitted(
        payload_kg=payload_kg,
        front_share_pct=front_share_pct,
        delay_s=told.get("delay_s") or wheelbase_m / record["mean_speed_mps"],
        delay_std_s=told.get("delay_std_s") or 0.0,
        damper_front_ratio=told.get("damper_front_ratio") or 1.0,
        damper_rear_ratio=told.get("damper_rear_ratio") or 1.0,
        delay_scale=told.get("delay_scale"),
        payload_mode_hz=told.get("payload_mode_hz"),
        amplitude_ratio=told.get("amplitude_ratio") or 1.0,
    )


def _is_whole(seen: SpectraSeen) -> bool:
    """True where every number is known and both sensors moved at every frequency."""
    is_known = all(np.isfinite(getattr(seen, name)).all() for name in seen.__slots__)
    return is_known and bool((seen.vertical_acceleration > 0.0).all() and (seen.pitch_rate > 0.0).all())


def _bands(calibrated: CalibratedVehicle | None) -> dict[str, list[dict[str, float]] | None]:
    index = None if calibrated is None else calibrated.ratio_index
    return {
        "acceleration_bands": None if index is None else _pair(index.acceleration_bands),
        "pitch_rate_bands": None if index is None else _pair(index.pitch_rate_bands),
    }


def _pair(bands: tuple[Band, Band] | None) -> list[dict[str, float]] | None:
    return None if bands is None else [{"centre_hz": b.centre_hz, "width_hz": b.width_hz} for b in bands]
