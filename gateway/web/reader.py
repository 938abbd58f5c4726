"""What the web needs of a store, whatever keeps it."""

from typing import Protocol

from gateway.history import Page


class Reader(Protocol):
    """Blocking questions, each from a thread of its own.

    Raises ValueError for a cursor that is none, TimeoutError for a question that takes too long,
    StoreError for a store that cannot be read.
    """

    def estimates(
        self,
        *,
        since_ns: int | None = None,
        until_ns: int | None = None,
        limit: int = 100,
        cursor: str | None = None,
        newest_first: bool = False,
        with_spectra: bool = True,
    ) -> Page: ...

    def entries(
        self,
        *,
        kind: str | None = None,
        since_ns: int | None = None,
        until_ns: int | None = None,
        limit: int = 100,
        cursor: str | None = None,
        upto: str | None = None,
        newest_first: bool = False,
    ) -> Page: ...
