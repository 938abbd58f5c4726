"""/api/v1/weights/j1939: weights as SAE J1939-71 counts them, for back-ends that store those."""

from fastapi import APIRouter
from pydantic import BaseModel, Field

from gateway.j1939 import NOT_AVAILABLE, POWERED_WEIGHT, Count, counts_of
from gateway.records import iso_utc
from gateway.web.live.board import Board
from gateway.web.routes.weights import Scales


class J1939Weight(BaseModel):
    """One parameter. ``raw`` is the count on the wire; 65535 means not available, 65024 error; then ``kg`` is null."""

    pgn: int = Field(examples=[65258])
    spn: int = Field(examples=[582])
    name: str = Field(examples=["Axle Weight"])
    axle: int | None = Field(None, description="counted from 1 at the front", examples=[1])
    kg: float | None = Field(description="raw times the resolution", examples=[845.0])
    kg_per_bit: float = Field(examples=[0.5])
    raw: int = Field(ge=0, le=NOT_AVAILABLE, examples=[1690])


class J1939Weights(BaseModel):
    """Vehicle Weight (VW) and Combination Vehicle Weight (CVW) of the estimate that ``/estimates/latest`` shows."""

    id: str | None = Field(description="of the estimate")
    t_end: str | None
    age_s: float | None
    is_stale: bool
    parameters: list[J1939Weight]


def j1939_router(board: Board, scales: Scales, *, draws_trailers: bool) -> APIRouter:
    """The route that gives weights in J1939's terms; ``draws_trailers`` as for the frames that are sent."""
    router = APIRouter(prefix="/api/v1", tags=["standards"])

    @router.get("/weights/j1939")
    async def j1939_weights() -> J1939Weights:
        """Axle, cargo and gross weights with the SPNs, resolutions and counts of SAE J1939-71."""
        shown = board.shown()
        counts = counts_of(shown.estimate, scales.weigh(shown.estimate), draws_trailers=draws_trailers)
        return J1939Weights(
            id=None if shown.estimate is None else shown.estimate.id,
            t_end=None if shown.estimate is None else iso_utc(shown.estimate.t_end_ns),
            age_s=shown.age_s,
            is_stale=shown.is_stale,
            parameters=[_told(count) for count in counts if count.parameter is not POWERED_WEIGHT],
        )

    return router


def _told(count: Count) -> J1939Weight:
    parameter = count.parameter
    return J1939Weight(
        pgn=parameter.pgn,
        spn=parameter.spn,
        name=parameter.name,
        axle=count.axle,
        kg=count.kg,
        kg_per_bit=parameter.kg_per_bit,
        raw=count.raw,
    )
