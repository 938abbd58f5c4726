"""/rfms: our weights in the shape of rFMS 4, for back-ends that speak it.

Shaped, not conformant: hrTotalVehicleDistance and the driver's identity are mandatory there, and a weighing
gateway does not know them.
"""

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Annotated, Any, Final, Literal
from urllib.parse import urlencode

from fastapi import APIRouter, Header, Query, Request
from pydantic import BaseModel, ConfigDict, Field
from pydantic.json_schema import SkipJsonSchema
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse, Response

from gateway.estimate import Estimate, Weight
from gateway.estimate_json import estimate_from_json
from gateway.history import BATCHES
from gateway.records import iso_utc
from gateway.status import Status
from gateway.store import StoreReader
from gateway.web.instant import Instant
from gateway.web.live.board import Board
from gateway.web.routes.estimates import Cursor, asked
from gateway.web.routes.weights import Scales
from gateway.web.schemas import problem_responses

PREFIX: Final = "/rfms"
TRIGGER: Final = "TIMER"  # batches end by the clock
_PAGE: Final = 500
_MEDIA_TYPE: Final = r"application/vnd\.fmsstandard\.com\.{service}\.v(2\.1|3\.0|4\.0)\+json"
_ANY_JSON: Final = re.compile(r"\*/\*|application/\*|application/json", re.IGNORECASE)


class StatusesQuery(BaseModel):
    """Either latestOnly or a span that begins at starttime."""

    model_config = ConfigDict(extra="forbid")

    vin: str | SkipJsonSchema[None] = Field(None, max_length=17)
    trigger_filter: str | SkipJsonSchema[None] = Field(
        None, alias="triggerFilter", max_length=200, description="comma separated; our only trigger is TIMER"
    )
    latest_only: bool | SkipJsonSchema[None] = Field(None, alias="latestOnly")
    starttime: Instant | SkipJsonSchema[None] = None
    stoptime: Instant | SkipJsonSchema[None] = None
    datetype: Literal["created", "received"] = Field("received", description="the same here: the gateway is the server")
    cursor: Cursor | SkipJsonSchema[None] = Field(None, description="as moreDataAvailableLink has it")


class VehiclesQuery(BaseModel):
    """Paging, which one vehicle does not need."""

    model_config = ConfigDict(extra="forbid")

    last_vin: str | SkipJsonSchema[None] = Field(None, alias="lastVin", max_length=17)


def rfms_router(board: Board, reader: StoreReader, status: Callable[[], Status], scales: Scales) -> APIRouter:
    """The routes under /rfms."""
    router = APIRouter(prefix=PREFIX, tags=["standards"], responses=problem_responses(400, 406))

    @router.get("/vehicles", response_class=Response, responses=_answers("vehicles"))
    async def vehicles(
        query: Annotated[VehiclesQuery, Query()], accept: Annotated[str, Header(include_in_schema=False)] = "*/*"
    ) -> Response:
        """This vehicle; none where its VIN is not configured."""
        media_type = _media_type(accept, "vehicles")
        now = status()
        known = [] if now.vin is None or query.last_vin == now.vin else [_vehicle(now)]
        body = {"vehicleResponse": {"vehicles": known}, "moreDataAvailable": False}
        return JSONResponse(body, media_type=media_type)

    @router.get(
        "/vehiclestatuses",
        response_class=Response,
        responses={**_answers("vehiclestatuses"), **problem_responses(404, 503)},
    )
    async def vehicle_statuses(
        request: Request,
        query: Annotated[StatusesQuery, Query()],
        accept: Annotated[str, Header(include_in_schema=False)] = "*/*",
    ) -> Response:
        """Gross weight and axle loads by batch, rejected batches left out."""
        media_type = _media_type(accept, "vehiclestatuses")
        _refuse_contradictions(query)
        vin = status().vin
        if query.vin is not None and query.vin != vin:
            raise HTTPException(404, f"there is no vehicle {query.vin} here")
        batches, next_cursor = await _batches(board, reader, query, has_vin=vin is not None)
        body: dict[str, Any] = {
            "vehicleStatusResponse": {"vehicleStatuses": [_status(batch, vin, scales) for batch in batches]},
            "moreDataAvailable": next_cursor is not None,
            "requestServerDateTime": _now(),
        }
        if next_cursor is not None:
            body["moreDataAvailableLink"] = _link(request, next_cursor)
        return JSONResponse(body, media_type=media_type)

    return router


def _refuse_contradictions(query: StatusesQuery) -> None:
    """The combinations that rFMS answers with 400."""
    if query.latest_only and (query.starttime is not None or query.stoptime is not None):
        raise HTTPException(400, "give either latestOnly=true or starttime, not both")
    if not query.latest_only and query.starttime is None:
        raise HTTPException(400, "give latestOnly=true, or starttime (and stoptime)")
    if query.starttime is not None and query.stoptime is not None and query.stoptime <= query.starttime:
        raise HTTPException(400, "stoptime must be after starttime")


@dataclass(frozen=True, slots=True)
class _Weighed:
    """What a status needs of a batch that counted."""

    t_end: str
    estimate: Estimate

    @classmethod
    def stored(cls, record: Mapping[str, Any]) -> "_Weighed":
        """From the store's JSON."""
        return cls(record["t_end"], estimate_from_json(record))


async def _batches(
    board: Board, reader: StoreReader, query: StatusesQuery, *, has_vin: bool
) -> tuple[list[_Weighed], str | None]:
    triggers = None if query.trigger_filter is None else query.trigger_filter.upper().split(",")
    if not has_vin or (triggers is not None and TRIGGER not in triggers):
        return [], None
    if query.latest_only:
        shown = board.shown().estimate
        if shown is None:
            return [], None
        return [_Weighed(iso_utc(shown.t_end_ns), shown)], None
    page = await asked(
        reader,
        BATCHES,
        since_ns=query.starttime,
        until_ns=query.stoptime,
        limit=_PAGE,
        cursor=query.cursor,
        with_spectra=False,
    )
    records = (json.loads(item) for item in page.items)
    return [_Weighed.stored(record) for record in records if not record["rejected"]], page.next_cursor


def _vehicle(now: Status) -> dict[str, Any]:
    return {
        "vin": now.vin,
        "customerVehicleName": now.vehicle_id,
        "numberOfAxles": 2,
        "authorizedPaths": [f"{PREFIX}/vehiclestatuses"],
    }


def _status(batch: _Weighed, vin: str | None, scales: Scales) -> dict[str, Any]:
    told: dict[str, Any] = {
        "vin": vin,
        "triggerType": {"context": "RFMS", "type": TRIGGER},
        "createdDateTime": batch.t_end,
        "receivedDateTime": batch.t_end,
        "snapshotData": {},
    }
    weights = scales.weigh(batch.estimate)
    if weights.gross.is_known:
        told["grossCombinationVehicleWeight"] = round(weights.gross.kg)
    if scales.vehicle is not None:
        axles = [_axle(1, weights.front_axle), _axle(2, weights.rear_axle)]
        told["snapshotData"]["vehicleAxles"] = [axle for axle in axles if axle is not None]
    return told


def _axle(position: int, load: Weight) -> dict[str, int] | None:
    return {"vehicleAxlePosition": position, "vehicleAxleLoad": round(load.kg)} if load.is_known else None


def _media_type(accept: str, service: str) -> str:
    """What the client accepts and we can give, the first of its list; names count in any case."""
    ours = re.compile(_MEDIA_TYPE.format(service=service), re.IGNORECASE)
    for offered in accept.split(","):
        name = offered.partition(";")[0].strip()
        if ours.fullmatch(name):
            return name
        if _ANY_JSON.fullmatch(name):
            return "application/json"
    raise HTTPException(406, f"accept application/json or application/vnd.fmsstandard.com.{service}.v4.0+json")


def _link(request: Request, cursor: str) -> str:
    kept = [(name, text) for name, text in request.query_params.multi_items() if name != "cursor"]
    return f"{request.url.path}?{urlencode([*kept, ('cursor', cursor)])}"


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _answers(service: str) -> dict[int | str, dict[str, Any]]:
    shape = {"schema": {"type": "object"}}
    names = [f"application/vnd.fmsstandard.com.{service}.v{version}+json" for version in ("2.1", "3.0", "4.0")]
    return {
        200: {"description": f"rFMS-shaped {service}", "content": dict.fromkeys(["application/json", *names], shape)}
    }
