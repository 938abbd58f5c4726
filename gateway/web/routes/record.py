"""/api/v1/record: the ring log, listed and fetched. Raw frames may contain the vehicle's position: scope operate."""

import asyncio
import re
from collections.abc import AsyncIterator
from typing import Annotated, BinaryIO, Final

from fastapi import APIRouter, Header, Path, Request
from pydantic import BaseModel, Field
from starlette.responses import Response, StreamingResponse
from starlette.types import Receive, Scope, Send

from gateway.records import iso_utc
from gateway.stated.facts import Instant
from gateway.status import Segment
from gateway.web.access.guard import RECORD_PATH
from gateway.web.access.problems import problem_response
from gateway.web.routes.service_calls import FrameLog
from gateway.web.schemas import problem_responses

PIECE_BYTES: Final = 65_536  # chosen: of a file in memory for each client
_MEDIA_TYPE: Final = "application/gzip"
_RANGE: Final = re.compile(r"bytes=(?:([0-9]{1,18})-([0-9]{0,18})|-([0-9]{1,18}))")


class SegmentTold(BaseModel):
    """One file: gzip-compressed candump lines, the frames of at most an hour."""

    name: str = Field(examples=["00000042-20261121T035000Z.log.gz"])
    n_bytes: int = Field(description="bytes available now; the newest file grows", examples=[1_204_113])
    n_frames: int = Field(examples=[731_002])
    t_start: Instant = Field(description="stamp of the first frame")
    t_end: Instant = Field(description="stamp of the last")


class SegmentsTold(BaseModel):
    """In the order of their creation. Put one behind the other they are one log."""

    items: list[SegmentTold]


def record_router(log: FrameLog | None) -> APIRouter:
    router = APIRouter(tags=["record"])

    @router.get(RECORD_PATH)
    async def recorded_segments() -> SegmentsTold:
        """The files of the ring log that can be fetched, oldest first; none if it is off ([record] enabled)."""
        return SegmentsTold(items=[_told(segment) for segment in log.segments()] if log else [])

    @router.get(RECORD_PATH + "/{name}", response_class=Response, responses=_answers())
    async def recorded_segment(
        request: Request,
        name: Annotated[str, Path(max_length=64, description="as the list has it")],
        wanted: Annotated[
            str | None, Header(alias="Range", description="one range of bytes: to resume after a cut")
        ] = None,
    ) -> Response:
        """One file, as candump text in gzip: for `springscale estimate`, `springscale replay`, or zcat."""
        try:
            opened = await asyncio.to_thread(log.open, name) if log else None
        except OSError as refusal:
            return problem_response(503, f"the ring log cannot be read: {refusal}", request.url.path)
        if opened is None:
            return problem_response(404, "there is no such file: the list has all of them", request.url.path)
        file, size = opened
        piece = None if "if-range" in request.headers else _range(wanted, size)
        if piece is not None and piece.start >= piece.stop:
            file.close()
            beyond = {"content-range": f"bytes */{size}"}
            return problem_response(416, f"the file has {size} bytes", request.url.path, headers=beyond)
        return _FileResponse(file, name, size, piece)

    return router


def _told(segment: Segment) -> SegmentTold:
    return SegmentTold(
        name=segment.name,
        n_bytes=segment.n_bytes,
        n_frames=segment.n_frames,
        t_start=iso_utc(segment.first_ns),
        t_end=iso_utc(segment.last_ns),
    )


def _range(wanted: str | None, size: int) -> range | None:
    """The requested bytes, empty if there are none; None for the whole (RFC 9110, 14.2: an unintelligible range is
    ignored, and so are several ranges at a time).
    """
    found = _RANGE.fullmatch(wanted or "")
    if found is None:
        return None
    first, last, suffix = found.groups()
    if suffix is not None:
        return range(max(0, size - int(suffix)), size)
    if last and int(last) < int(first):
        return None
    return range(int(first), min(int(last) + 1, size) if last else size)


class _FileResponse(StreamingResponse):
    """Bytes of an open file, some at a time; it is closed at the end, or when the client has gone."""

    def __init__(self, file: BinaryIO, name: str, size: int, piece: range | None) -> None:
        chosen = range(size) if piece is None else piece
        headers = {
            "accept-ranges": "bytes",
            "content-length": str(len(chosen)),
            "content-disposition": f'attachment; filename="{name}"',
        }
        if piece is not None:
            headers["content-range"] = f"bytes {piece.start}-{piece.stop - 1}/{size}"
        super().__init__(_pieces(file, chosen), 200 if piece is None else 206, headers, _MEDIA_TYPE)
        self._file = file

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._file.close()


async def _pieces(file: BinaryIO, chosen: range) -> AsyncIterator[bytes]:
    await asyncio.to_thread(file.seek, chosen.start)
    n_left = len(chosen)
    while n_left and (piece := await asyncio.to_thread(file.read, min(PIECE_BYTES, n_left))):
        n_left -= len(piece)
        yield piece


def _answers() -> dict[int | str, dict[str, object]]:
    content = {_MEDIA_TYPE: {"schema": {"type": "string", "format": "binary"}}}
    file: dict[int | str, dict[str, object]] = {
        200: {"content": content, "description": "the whole file"},
        206: {"content": content, "description": "the bytes that Range asked for"},
    }
    return {**file, **problem_responses(404, 416, 422, 503)}
