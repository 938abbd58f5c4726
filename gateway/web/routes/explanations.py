"""/api/v1/reasons: the meaning of each reason in ``rejected``, and of each source of error in ``error_budget``, in
words.
"""

from fastapi import APIRouter
from pydantic import BaseModel, Field

from gateway.estimates.budget import Remedy
from gateway.estimates.reasons import EXPLANATIONS, REMEDIES, SOURCES, Cause
from gateway.records import Why


class ReasonInWords(BaseModel):
    """Why a batch may give no estimate, and what to do. Names in backquotes are settings of [batch]."""

    reason: Why = Field(examples=[Why.TOO_SLOW])
    cause: Cause = Field(examples=[Cause.DRIVE])
    happened: str = Field(
        examples=["the speed was below `speed_min_mps` for too much of the window: town traffic, a queue, a yard"]
    )
    advice: str = Field(examples=["nothing; an open road is enough"])


class SourceInWords(BaseModel):
    """A cause of error."""

    source: str = Field(examples=["load_length"])
    words: str = Field(examples=["the length and height of this very load"])


class RemedyInWords(BaseModel):
    """Remedies that narrow an error."""

    remedy: Remedy
    advice: str = Field(examples=["drive another ten minutes with the same load"])


class ReasonsInWords(BaseModel):
    """All reasons, and all sources of error with their remedies."""

    items: list[ReasonInWords]
    sources: list[SourceInWords]
    remedies: list[RemedyInWords]


def reasons_router() -> APIRouter:
    router = APIRouter(prefix="/api/v1", tags=["api"])
    explained = ReasonsInWords(
        items=[
            ReasonInWords(reason=why, cause=told.cause, happened=told.happened, advice=told.advice)
            for why, told in EXPLANATIONS.items()
        ],
        sources=[SourceInWords(source=source, words=words) for source, words in SOURCES.items()],
        remedies=[RemedyInWords(remedy=remedy, advice=advice) for remedy, advice in REMEDIES.items()],
    )

    @router.get("/reasons")
    async def reasons() -> ReasonsInWords:
        """The meaning of each reason in ``rejected`` and each source in ``error_budget``; fixed by the service's
        version.
        """
        return explained

    return router
