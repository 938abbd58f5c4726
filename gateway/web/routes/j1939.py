"""/api/v1/weights/j1939: weights as SAE J1939-71 counts them, for back-ends that store those."""

import math
from dataclasses import asdict, dataclass
from typing import Final

from fastapi import APIRouter
from pydantic import BaseModel, Field

from gateway.estimate import Weights
from gateway.records import iso_utc
from gateway.web.live.board import Board
from gateway.web.routes.weights import Scales

NOT_AVAILABLE: Final = 0xFFFF  # of a two-byte parameter (SAE J1939-71, table 1)
LARGEST: Final = 0xFAFF  # its largest valid count


@dataclass(frozen=True, slots=True)
class Parameter:
    """A two-byte parameter of J1939: kilograms a bit, offset 0."""

    pgn: int
    spn: int
    name: str
    kg_per_bit: float


AXLE_WEIGHT: Final = Parameter(65258, 582, "Axle Weight", 0.5)
CARGO_WEIGHT: Final = Parameter(65258, 181, "Cargo Weight", 2.0)
GROSS_WEIGHT: Final = Parameter(65136, 1760, "Gross Combination Vehicle Weight", 10.0)


class J1939Weight(BaseModel):
    """One parameter. ``raw`` is the count on the wire; 65535 says not available, and then ``kg`` is null."""

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


def j1939_router(board: Board, scales: Scales) -> APIRouter:
    """The route that tells weights in J1939's terms."""
    router = APIRouter(prefix="/api/v1", tags=["standards"])

    @router.get("/weights/j1939")
    async def j1939_weights() -> J1939Weights:
        """Axle, cargo and gross weights with the SPNs, resolutions and counts of SAE J1939-71."""
        shown = board.shown()
        return J1939Weights(
            id=None if shown.estimate is None else shown.estimate.id,
            t_end=None if shown.estimate is None else iso_utc(shown.estimate.t_end_ns),
            age_s=shown.age_s,
            is_stale=shown.is_stale,
            parameters=parameters_of(scales.weigh(shown.estimate), shown.payload.number),
        )

    return router


def parameters_of(weights: Weights, payload_kg: float) -> list[J1939Weight]:
    """Every parameter; what is not known is sent as not available."""
    return [
        _counted(AXLE_WEIGHT, weights.front_axle.kg, axle=1),
        _counted(AXLE_WEIGHT, weights.rear_axle.kg, axle=2),
        _counted(CARGO_WEIGHT, payload_kg),
        _counted(GROSS_WEIGHT, weights.gross.kg),
    ]


def _counted(parameter: Parameter, kg: float, axle: int | None = None) -> J1939Weight:
    """Counts cannot be negative: an empty vehicle weighed a little below zero carries nothing."""
    if not math.isfinite(kg) or kg > LARGEST * parameter.kg_per_bit:
        return J1939Weight(**asdict(parameter), axle=axle, kg=None, raw=NOT_AVAILABLE)
    raw = max(0, round(kg / parameter.kg_per_bit))
    return J1939Weight(**asdict(parameter), axle=axle, kg=raw * parameter.kg_per_bit, raw=raw)
