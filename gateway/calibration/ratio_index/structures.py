"""Which regressors: the paper's fixed structures, one of our own, and what a stepwise choice may pick from."""

from typing import Final, Literal

from gateway.calibration.ratio_index.table import SpectrumTable
from gateway.core.ratio_index.regression import (
    MODEL_9_PAYLOAD,
    MODEL_10_FRONT_SHARE,
    MODEL_11_FRONT_SHARE,
    MODEL_11_PAYLOAD,
    TERMS,
)

Family = Literal["single", "log", "joint", "stepwise"]
StructureChoice = Literal["auto", "single", "log", "joint", "stepwise"]

# "single" are (9) and (10), each target from its own index; "joint" is (11); "log" is linear in both logarithms;
# "stepwise" picks from the whole library. In the order tried: of equals the earlier is taken.
FAMILIES: Final[tuple[Family, ...]] = ("single", "log", "joint", "stepwise")
BOTH_LOGS: Final = ("log_ra", "log_rg")

_FIXED: Final[dict[Family, tuple[tuple[str, ...], tuple[str, ...]]]] = {  # of payload, of front share
    "single": (MODEL_9_PAYLOAD, MODEL_10_FRONT_SHARE),
    "log": (BOTH_LOGS, BOTH_LOGS),
    "joint": (MODEL_11_PAYLOAD, MODEL_11_FRONT_SHARE),
}


def terms_of(family: Family, target: int, table: SpectrumTable) -> tuple[str, ...]:
    """The terms of a fixed family, or the library that stepwise picks from; none where the campaign is too small.

    Wanted are the sensors, two runs more than terms (of stepwise: than one), and three different front
    shares where the share is the target (1) or both indexes take part.
    """
    absent = {index for index, spectra in zip(("ra", "rg"), table.spectra, strict=True) if spectra is None}
    is_free = family == "stepwise"
    terms = tuple(term for term in TERMS if not _indexes(term) & absent) if is_free else _FIXED[family][target]
    indexes = set().union(*(_indexes(term) for term in terms))
    wants_shares = target == 1 or len(indexes) > 1
    is_enough = table.n_runs >= (1 if is_free else len(terms)) + 2 and (table.n_shares >= 3 or not wants_shares)
    return terms if is_enough and not indexes & absent else ()


def _indexes(term: str) -> set[str]:
    return {index for index in ("ra", "rg") if index in term}
