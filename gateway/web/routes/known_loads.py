"""/api/v1/known-loads: the actual load, if it is known, as in the demonstration."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from fastapi import APIRouter
from pydantic import BaseModel, Field

from gateway.records import iso_utc

KNOWN_LOADS_PATH: Final = "/api/v1/known-loads"


@dataclass(frozen=True, slots=True)
class KnownLoad:
    """From t_start_ns on, until the next: payload and front share of the sprung mass."""

    t_start_ns: int
    payload_kg: float
    front_share_pct: float


KnownLoads = Callable[[], Sequence[KnownLoad]]


class KnownLoadTold(BaseModel):
    """From ``t_start`` on, until the next."""

    t_start: str = Field(json_schema_extra={"format": "date-time"})
    payload_kg: float
    front_share_pct: float


class KnownLoadsTold(BaseModel):
    """In order of time. They are for comparison only: no estimate uses them."""

    items: list[KnownLoadTold]


def known_loads_router(known_loads: KnownLoads) -> APIRouter:
    """Their route; a service on the road has no known loads."""
    router = APIRouter(tags=["api"])

    @router.get(KNOWN_LOADS_PATH)
    async def told() -> KnownLoadsTold:
        """The actual load, as the simulator of the demonstration knows it."""
        return KnownLoadsTold(
            items=[
                KnownLoadTold(
                    t_start=iso_utc(load.t_start_ns), payload_kg=load.payload_kg, front_share_pct=load.front_share_pct
                )
                for load in known_loads()
            ]
        )

    return router
