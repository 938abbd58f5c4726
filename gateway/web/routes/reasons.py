"""/api/v1/reasons: what each reason in ``rejected`` means, in words."""

from fastapi import APIRouter
from pydantic import BaseModel, Field
from starlette.responses import Response

from gateway.reasons import EXPLANATIONS, Cause
from gateway.records import Why


class ReasonInWords(BaseModel):
    """Why a batch may give no estimate, and what to do. Names in backquotes are settings of [batch]."""

    reason: Why = Field(examples=[Why.TOO_SLOW])
    cause: Cause = Field(examples=[Cause.DRIVE])
    happened: str = Field(examples=["too much of the window below `speed_min_mps`: town, queue, yard"])
    advice: str = Field(examples=["nothing; the next open road will do"])


class ReasonsInWords(BaseModel):
    """Every reason there is."""

    items: list[ReasonInWords]


def reasons_router() -> APIRouter:
    """The route that explains."""
    router = APIRouter(prefix="/api/v1", tags=["api"])
    explained = ReasonsInWords(
        items=[
            ReasonInWords(reason=why, cause=told.cause, happened=told.happened, advice=told.advice)
            for why, told in EXPLANATIONS.items()
        ]
    )
    body = explained.model_dump_json()

    @router.get("/reasons", response_model=ReasonsInWords)
    async def reasons() -> Response:
        """What each reason in ``rejected`` means; the same as long as the service's version is."""
        return Response(body, media_type="application/json")

    return router
