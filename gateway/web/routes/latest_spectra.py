"""/api/v1/spectra/latest: the measured spectra of the last batch, and those that the fitted vehicle predicts."""

import math
from typing import Any

import numpy as np
from fastapi import APIRouter
from pydantic import BaseModel, Field
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response

from gateway.core.ratio_index.index import Band
from gateway.estimates.as_json import estimate_to_json, spectra_to_json
from gateway.estimates.batch_estimate import Estimate
from gateway.model.displayed import Fitted, modelled_spectra
from gateway.records import Spectra as SpectraSeen
from gateway.records import Why, json_line
from gateway.web.live.board import Board
from gateway.web.schemas import Spectra
from gateway.weighing.calibrated import CalibratedVehicle

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
    payload_kg: float | None = Field(examples=[271.3])
    front_share_pct: float | None = Field(examples=[50.4])
    spectra: Spectra | None = Field(description="as measured")
    model: Spectra | None = Field(
        description="of the calibrated vehicle with this payload and share; null if the estimator has no such model "
        "or the batch no answer. Its frequencies are those that calibration used"
    )
    acceleration_bands: list[BandHz] | None = Field(description="ratio index: numerator and denominator")
    pitch_rate_bands: list[BandHz] | None = Field(description="ratio index: numerator and denominator")


def spectra_router(board: Board, calibrated: CalibratedVehicle | None) -> APIRouter:
    """The route of the spectra; ``calibrated`` is the calibration that the service uses."""
    router = APIRouter(prefix="/api/v1", tags=["vehicle"])
    made: dict[str | None, str] = {}  # the answer on the last batch asked for

    @router.get("/spectra/latest", response_model=LatestSpectra)
    async def latest_spectra() -> Response:
        """Auto- and cross-spectra of the last batch, the fitted model's beside them, and the ratio index's bands."""
        heard = board.heard()
        identity = None if heard is None else heard.id
        if (answer := made.get(identity)) is None:
            answer = await run_in_threadpool(_answer_on, heard, calibrated)
            made.clear()
            made[identity] = answer
        return Response(answer, media_type="application/json")

    return router


def _answer_on(heard: Estimate | None, calibrated: CalibratedVehicle | None) -> str:
    """The JSON of a LatestSpectra; ``heard`` is the last batch, None before the first."""
    if heard is None:
        told: dict[str, Any] = dict.fromkeys(HEAD) | {"rejected": [str(Why.NO_ESTIMATE_YET)]}
        shown: dict[str, Any] = {"spectra": None, "model": None}
    else:
        record, model = estimate_to_json(heard), modelled_of(heard, calibrated)
        told = {name: record[name] for name in HEAD}
        shown = {"spectra": record.get("spectra"), "model": None if model is None else spectra_to_json(model)}
    return json_line({**told, **shown, **_bands(calibrated)})


def modelled_of(heard: Estimate, calibrated: CalibratedVehicle | None) -> SpectraSeen | None:
    """The fitted model's spectra for one batch; None if there is no model, no answer or no spectrum."""
    if calibrated is None or calibrated.cross_spectrum is None or heard.estimator != "cross_spectrum":
        return None
    if heard.calibration_id != calibrated.id:
        return None  # weighed with an earlier calibration
    fitted = _fitted(heard, calibrated.cross_spectrum.wheelbase_m)
    if fitted is None or heard.spectra is None or not _is_whole(heard.spectra):
        return None
    return modelled_spectra(heard.spectra, calibrated.cross_spectrum, fitted)


def _fitted(heard: Estimate, wheelbase_m: float) -> Fitted | None:
    """The delay that the estimator fitted; else that of the mean speed."""
    told = {name: x for name, x in heard.diagnostics.items() if math.isfinite(x)}
    payload_kg, front_share_pct = heard.payload.number, heard.front_share.number
    if not (math.isfinite(payload_kg) and math.isfinite(front_share_pct) and heard.mean_speed_mps > 0.0):
        return None
    return Fitted(
        payload_kg=payload_kg,
        front_share_pct=front_share_pct,
        delay_s=told.get("delay_s") or wheelbase_m / heard.mean_speed_mps,
        delay_std_s=told.get("delay_std_s", 0.0),
        damper_front_ratio=told.get("damper_front_ratio") or 1.0,
        damper_rear_ratio=told.get("damper_rear_ratio") or 1.0,
        delay_scale=told.get("delay_scale"),
        payload_gyration_m2=told.get("payload_gyration_m2"),
        payload_mode_hz=told.get("payload_mode_hz"),
        payload_damping_ratio=told.get("payload_damping_ratio"),
        amplitude_ratio=told.get("amplitude_ratio") or 1.0,
        cg_left_m=heard.cg_left.number if math.isfinite(heard.cg_left.number) else 0.0,
    )


def _is_whole(seen: SpectraSeen) -> bool:
    """True if every number is known and both sensors moved at every frequency."""
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
