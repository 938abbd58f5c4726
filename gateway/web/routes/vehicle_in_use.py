"""/api/v1/vehicle: the vehicle, its calibration and its signals."""

import asyncio
from collections.abc import Callable
from typing import Annotated, Any, Final

from fastapi import APIRouter, Query, Request
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from gateway.core.vehicle import Vehicle
from gateway.stated.facts import VehicleAnswers
from gateway.stated.learning import SisterTold, StatedVehicle
from gateway.status import SignalHealth, Status
from gateway.web.routes.service_calls import By, LearnerBackend
from gateway.web.schemas import problem_responses, utf8_only
from gateway.weighing.calibrated import BY_MODEL, CalibratedVehicle


class CalibrationFigures(BaseModel):
    """The calibration in use and the loads it saw: the ranges in which answers are trusted."""

    id: str
    estimators: tuple[str, ...] = Field(description="those it can serve", examples=[["cross_spectrum", "ratio_index"]])
    payload_seen_kg: tuple[float, float] = Field(examples=[[0.0, 420.0]])
    front_share_seen_pct: tuple[float, float] = Field(examples=[[41.0, 58.0]])
    payload_believed_kg: tuple[float, float] = Field(
        description="an interval that lies outside, or is wider, is rejected as out_of_range"
    )
    front_share_believed_pct: tuple[float, float] | None = Field(
        description="an interval that lies outside is rejected as out_of_range; null: one share seen, no limit"
    )
    speed_seen_mps: tuple[float, float] | None = Field(description="batch means", examples=[[13.5, 14.1]])


class VehicleDescription(BaseModel):
    """The vehicle's identity, its calibration, and the health of its signals."""

    vehicle_id: str | None
    vin: str | None
    estimator: str | None
    calibration: CalibrationFigures | None = Field(description="null: not calibrated, no payload can be estimated")
    figures: Vehicle | None = Field(
        description="the vehicle as its campaign stated it, with the limits in force; unknown is null"
    )
    signals: tuple[SignalHealth, ...]
    stated: StatedVehicle | None = Field(None, description="as somebody stated it to this service; null: nobody has")
    sister: SisterTold | None = Field(None, description="null: nothing is known of a vehicle of its model")


_CALIBRATION: Final[dict[str, Any]] = {
    "required": True,
    "content": {"application/json": {"schema": {"type": "object"}}},
}


class ConfirmQuery(BaseModel):
    """Whether unlikely figures are right."""

    model_config = ConfigDict(extra="forbid")

    confirm: bool = Field(False, description="the figures are right, although some are unlikely (`doubts`)")


def vehicle_router(
    status: Callable[[], Status], calibrated: CalibratedVehicle | None, learner: LearnerBackend | None = None
) -> APIRouter:
    """The routes about the vehicle itself; ``calibrated`` is the calibration that the service uses."""
    router = APIRouter(prefix="/api/v1", tags=["vehicle"])
    of_sister = problem_responses(400, 403, 409, 413, 422, 503)

    def described() -> VehicleDescription:
        now = status()
        return VehicleDescription(
            vehicle_id=now.vehicle_id,
            vin=now.vin,
            estimator=now.estimator,
            calibration=None if calibrated is None else _calibration(calibrated, now.estimator or BY_MODEL),
            figures=None if calibrated is None else calibrated.vehicle,
            signals=now.signals,
            stated=None if learner is None else learner.van.told(),
            sister=None if learner is None else learner.van.sister(),
        )

    @router.get("/vehicle")
    async def vehicle() -> VehicleDescription:
        """The vehicle's identity, its calibration and ranges, the health of its signals, and what was stated of it."""
        return described()

    if learner is not None:

        @router.put("/vehicle", responses=problem_responses(400, 403, 409, 422, 503))
        async def state_vehicle(
            by: By,
            said: Annotated[VehicleAnswers, BeforeValidator(utf8_only)],
            query: Annotated[ConfirmQuery, Query()],
        ) -> VehicleDescription:
            """State the vehicle: axle weights of the empty vehicle, wheelbase, the sensor's place, limits.

            Unlikely figures are kept and asked about (`stated.doubts`): nothing is learnt until they are corrected, or
            confirmed with `?confirm=true`.
            """
            await asyncio.to_thread(learner.van.state, said, by, is_confirmed=query.confirm)
            return described()

        @router.put("/vehicle/sister", responses=of_sister, openapi_extra={"requestBody": _CALIBRATION})
        async def state_sister(by: By, request: Request) -> VehicleDescription:
            """Hand in the calibration file of a vehicle of the same model: what is learnt begins with it."""
            await asyncio.to_thread(learner.van.state_sister, await request.body(), by)
            return described()

        @router.delete("/vehicle/sister", responses=of_sister)
        async def forget_sister(by: By) -> VehicleDescription:
            """Learn again without the file that was handed in."""
            await asyncio.to_thread(learner.van.forget_sister, by)
            return described()

    return router


def _calibration(calibrated: CalibratedVehicle, estimator: str) -> CalibrationFigures:
    by_estimator = {"cross_spectrum": calibrated.cross_spectrum, "ratio_index": calibrated.ratio_index}
    return CalibrationFigures(
        id=calibrated.id,
        estimators=tuple(name for name, part in by_estimator.items() if part is not None),
        payload_seen_kg=calibrated.payload_seen_kg,
        front_share_seen_pct=calibrated.front_share_seen_pct,
        payload_believed_kg=calibrated.payload_believed_kg(estimator),
        front_share_believed_pct=calibrated.front_share_believed_pct(estimator),
        speed_seen_mps=_speed_seen_mps(calibrated),
    )


def _speed_seen_mps(calibrated: CalibratedVehicle) -> tuple[float, float] | None:
    if calibrated.cross_spectrum is not None:
        return calibrated.cross_spectrum.speed_seen_mps
    return None if calibrated.ratio_index is None else calibrated.ratio_index.speed_range_mps
