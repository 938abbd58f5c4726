"""/api/v1/reasons: the meaning of each reason in ``rejected``, and of each source of error in ``error_budget``, in
words.
"""

from collections.abc import Mapping

from fastapi import APIRouter
from pydantic import BaseModel, Field

from gateway.estimates.budget import Remedy
from gateway.estimates.reasons import EXPLANATIONS, REMEDIES, SOURCES, Explanation
from gateway.records import Why


class ReasonsInWords(BaseModel):
    """All reasons, and all sources of error with their remedies, by name."""

    reasons: Mapping[Why, Explanation] = Field(
        description="why a batch may give no estimate, and what to do; names in backquotes are settings of [batch]"
    )
    sources: Mapping[str, str] = Field(examples=[{"load_length": "the length and height of this very load"}])
    remedies: Mapping[Remedy, str] = Field(examples=[{"drive_on": "drive another ten minutes with the same load"}])


def reasons_router() -> APIRouter:
    router = APIRouter(prefix="/api/v1", tags=["api"])
    explained = ReasonsInWords(reasons=EXPLANATIONS, sources=SOURCES, remedies=REMEDIES)

    @router.get("/reasons")
    async def reasons() -> ReasonsInWords:
        """The meaning of each reason in ``rejected`` and each source in ``error_budget``; fixed by the service's
        version.
        """
        return explained

    return router
