"""/api/v1/calibration/trend: changes of the vehicle's own parameters, and of the gyro, since it was calibrated."""

from typing import Final, Literal, Protocol

from fastapi import APIRouter, Request
from pydantic import BaseModel, Field
from starlette.responses import Response

from gateway.web.routes.service_calls import call_service

TREND_PATH: Final = "/calibration/trend"


class TrendBackend(Protocol):
    """The service's trend of parameters."""

    def state(self) -> str:
        """A TrendState."""
        ...


class PointTold(BaseModel):
    """A week's mean, by the date of its Monday, or one empty vehicle."""

    t: str
    number: float
    n: int = Field(description="batches in it")


class ParameterTrend(BaseModel):
    """Off the calibration: percent; the zero in kg."""

    name: str = Field(examples=["damper_rear"])
    unit: Literal["%", "kg"]
    points: list[PointTold]
    change: float | None = Field(description="from the first point to the last; null: too few points")
    interval99: tuple[float, float] | None = Field(description="of the change")
    is_drifting: bool
    level: float | None = Field(description="where the newest batches stand off the calibration; null: too few of them")
    level99: tuple[float, float] | None = Field(description="of the level")
    is_off: bool = Field(
        description="whether the level is neither chance nor small: dampers from 20 %, a gain from 2 %"
    )


class TrendState(BaseModel):
    """Of the calibration in use."""

    calibration_id: str | None
    parameters: list[ParameterTrend]


def trend_router(backend: TrendBackend) -> APIRouter:
    """The route of the trend."""
    router = APIRouter(prefix="/api/v1", tags=["calibration"])

    @router.get(TREND_PATH, response_model=TrendState)
    async def parameter_trend(request: Request) -> Response:
        """Dampers, the delay's scale, the gyro's gain and the zero over the months: whether they drift or are off."""
        return await call_service(request, backend.state)

    return router
