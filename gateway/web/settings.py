"""The settings of the web, apart from the address it listens on."""

from dataclasses import dataclass
from typing import Final

PAGE_LIMIT: Final = 1000  # records in one answer; part of the described API, therefore no setting


@dataclass(frozen=True, slots=True)
class WebSettings:
    """keep_alive_s between comments on a quiet stream; n_streams_max streams at a time, then 503.

    n_wrong_tokens_per_min from one address, then its wrong tokens are answered with 429.
    """

    keep_alive_s: float = 15.0
    n_streams_max: int = 100
    n_wrong_tokens_per_min: int = 10
