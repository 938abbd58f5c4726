"""How well the calibration still holds: known loads compared with the estimates, as dated records and as pages."""

import base64
import hashlib
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Annotated, Any, Final

from fastapi import APIRouter, Path, Request
from pydantic import BaseModel, Field
from starlette.responses import HTMLResponse, Response

from gateway.stated.facts import Rule, VerificationRecord
from gateway.status import VerificationStatus
from gateway.web.access.middleware import content_security_policy
from gateway.web.access.problems import problem_response
from gateway.web.routes.known_weights import Stated
from gateway.web.routes.service_calls import REFUSALS, By, VerificationBackend, answered, created
from gateway.web.schemas import Body, problem_responses
from gateway.words import one_or_more

VERIFICATIONS_PATH: Final = "/calibration/verifications"
_PAGE: Final[dict[int | str, dict[str, Any]]] = {
    200: {"content": {"text/html": {"schema": {"type": "string"}}}, "description": "the page"}
}


class VerificationRequest(Body):
    """The loads that were weighed, and a word on them."""

    loads: list[Stated] = Field(min_length=1, max_length=10)
    note: str = Field("", max_length=200, description="kept with the record: scales used, place, weather")


class VerificationState(BaseModel):
    """The requirements, when the next one is due, and the records, newest first."""

    rule: Rule
    due: VerificationStatus
    warning: str | None = Field(description="what is wrong with the file of the records")
    history: list[VerificationRecord]


def verification_router(backend: VerificationBackend) -> APIRouter:
    router = APIRouter(prefix="/api/v1", tags=["calibration"])

    @router.get(VERIFICATIONS_PATH, response_model=VerificationState)
    async def verification_state() -> Response:
        """The requirements, when a verification is due, and the records."""
        return await answered(backend.state)

    @router.post(
        VERIFICATIONS_PATH,
        status_code=201,
        response_model=VerificationRecord,
        responses={**REFUSALS, **problem_responses(400, 422)},
    )
    async def verify(by: By, claim: VerificationRequest) -> Response:
        """Compare known loads with their estimates. The calibration does not change; the record is on disk before the
        answer.
        """
        stated = [load.stated() for load in claim.loads]
        return await created(backend.verify, by, claim.note or None, stated)

    @router.get(
        VERIFICATIONS_PATH + "/{record_id}",
        response_class=Response,
        responses={**_PAGE, **problem_responses(404, 422)},
    )
    async def verification_record(
        request: Request, record_id: Annotated[str, Path(max_length=80, description="as the list has it")]
    ) -> Response:
        """One record as a page to print, or to keep as a file: it needs nothing else."""
        record = backend.record(record_id)
        if record is None:
            return problem_response(404, "there is no such record: the list has all of them", request.url.path)
        return HTMLResponse(verification_page(record), headers={"content-security-policy": POLICY})

    return router


_STYLE: Final = """
body { font: 11pt/1.4 system-ui, sans-serif; color: #111; max-width: 48rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.4rem; margin-bottom: 0; }
table { border-collapse: collapse; width: 100%; margin: 1rem 0; font-variant-numeric: tabular-nums; }
th, td { border-bottom: 1px solid #bbb; padding: 0.3rem 0.5rem; text-align: right; vertical-align: top; }
th:first-child, td:first-child { text-align: left; }
dl { display: grid; grid-template-columns: 12rem 1fr; gap: 0.2rem 1rem; }
dt { color: #444; } dd { margin: 0; overflow-wrap: anywhere; }
.verdict { font-size: 1.2rem; font-weight: 600; border: 2px solid #111; display: inline-block; padding: 0.3rem; }
.sign { margin-top: 3rem; display: flex; gap: 2rem; }
.sign p { border-top: 1px solid #111; flex: 1; padding-top: 0.3rem; }
@page { margin: 2cm; }
"""
_HASH: Final = base64.b64encode(hashlib.sha256(_STYLE.encode()).digest()).decode()
POLICY: Final = content_security_policy(f"'sha256-{_HASH}'")


def verification_page(record: Mapping[str, Any]) -> str:
    """A VerificationRecord as HTML."""
    rule = record["rule"]
    axles = rule["permitted_axle_error_pct"]
    asked = f"at most {rule['permitted_error_pct']:g} % of the known gross weight"
    asked += "" if axles is None else f", and at most {axles:g} % of each axle's"
    asked += f"; {one_or_more(rule['loads'], 'load', 'loads')} at least"
    facts = {
        "Vehicle": record["vehicle_id"] or "",
        "Date": _moment(record["at"]),
        "By": record["by"],
        "Note": record["note"] or "",
        "Permitted error": asked,
        "Estimator": record["estimator"],
        "Calibration": record["calibration_id"],
        "Known weights": record["known_weights_id"] or "none: by the calibration alone",
        "Record": record["id"],
    }
    parts = [
        "<h1>Verification of on-board weighing</h1>",
        f'<p class="verdict">{escape(record["verdict"])}</p>',
        "<dl>"
        + "".join(f"<dt>{escape(name)}</dt><dd>{escape(str(told))}</dd>" for name, told in facts.items())
        + "</dl>",
        _table(
            (
                "Load weighed",
                "known payload [kg]",
                "weighed ± 95 % [kg]",
                "error [kg]",
                "of the gross weight",
                "within",
            ),
            [_load(load) for load in record["loads"]],
        ),
        *_axles(record["loads"]),
        "<p>Known loads were compared with the estimates of the driving vehicle, each estimate without knowledge of "
        "that very load; the calibration did not change. An error is estimate minus known.</p>",
        '<div class="sign"><p>Place, date</p><p>Name, signature</p></div>',
    ]
    head = f'<meta charset="utf-8"><title>Verification {escape(record["at"][:10])}</title><style>{_STYLE}</style>'
    return f'<!doctype html>\n<html lang="en"><head>{head}</head><body>\n' + "\n".join(parts) + "\n</body></html>\n"


def _load(load: Mapping[str, Any]) -> Sequence[str]:
    return (
        f"{_moment(load['t_start'])} to {_moment(load['t_end'])}, {one_or_more(load['n_batches'], 'batch', 'batches')}",
        f"{load['known_payload_kg']:.0f}",
        f"{load['payload_kg']:.0f} ± {1.96 * load['payload_std_kg']:.0f}",
        f"{load['error_kg']:+.1f}",
        f"{load['error_pct']:+.2f} %",
        "yes" if load["is_within"] else "no",
    )


def _axles(loads: Iterable[Mapping[str, Any]]) -> list[str]:
    rows = [
        (
            f"{_moment(load['t_start'])}, {name}",
            f"{axle['known_kg']:.0f}",
            f"{axle['error_kg']:+.1f}",
            f"{axle['error_pct']:+.2f} %",
        )
        for load in loads
        for name, axle in (("front axle", load["front_axle"]), ("rear axle", load["rear_axle"]))
        if axle is not None
    ]
    return [_table(("Axle", "known [kg]", "error [kg]", "of the known"), rows)] if rows else []


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    top = "".join(f'<th scope="col">{escape(name)}</th>' for name in head)
    lines = ("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{top}</tr></thead><tbody>{''.join(lines)}</tbody></table>"


def _moment(text: str) -> str:
    return f"{text[:10]} {text[11:16]} UTC"
