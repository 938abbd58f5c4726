"""/api/v1/reasons: what each reason in ``rejected`` means, and each source of error in ``error_budget``, in words."""

from fastapi import APIRouter
from pydantic import BaseModel, Field
from starlette.responses import Response

from gateway.budget import Remedy
from gateway.reasons import EXPLANATIONS, REMEDIES, SOURCES, Cause
from gateway.records import Why


class ReasonInWords(BaseModel):
    """Why a batch may give no estimate, and what to do. Names in backquotes are settings of [batch]."""

    reason: Why = Field(examples=[Why.TOO_SLOW])
    cause: Cause = Field(examples=[Cause.DRIVE])
    happened: str = Field(examples=["too much of the window below `speed_min_mps`: town, queue, yard"])
    advice: str = Field(examples=["nothing; the next open road will do"])


class SourceInWords(BaseModel):
    """A cause of error."""

    source: str = Field(examples=["load_length"])
    words: str = Field(examples=["how long and high this very load is"])


class RemedyInWords(BaseModel):
    """What would narrow an error."""

    remedy: Remedy
    advice: str = Field(examples=["drive another ten minutes with the same load"])


class ReasonsInWords(BaseModel):
    """Every reason there is, and every source of error with what narrows it."""

    items: list[ReasonInWords]
    sources: list[SourceInWords]
    remedies: list[RemedyInWords]


def reasons_router() -> APIRouter:
    """The route that explains."""
    router = APIRouter(prefix="/api/v1", tags=["api"])
    explained = ReasonsInWords(
        items=[
            ReasonInWords(reason=why, cause=told.cause, happened=told.happened, advice=told.advice)
            for why, told in EXPLANATIONS.items()
        ],
        sources=[SourceInWords(source=source, words=words) for source, words in SOURCES.items()],
        remedies=[RemedyInWords(remedy=remedy, advice=advice) for remedy, advice in REMEDIES.items()],
    )
    body = explained.model_dump_json()

    @router.get("/reasons", response_model=ReasonsInWords)
    async def reasons() -> Response:
        """What each reason in ``rejected`` and each source in ``error_budget`` means; fixed by the service's
        version.
        """
        return Response(body, media_type="application/json")

    return router
