"""Errors to expect of loads that calibration has not seen: every run judged by what the other runs teach."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from gateway.calibration.calibrate import Outcome
from gateway.calibration.judgement.evaluation import Judged, judge


def judged_left_out(outcome: Outcome, estimator: str) -> list[Judged]:
    """Every identification batch with its estimate by a calibration from the other runs.

    Empty where fewer than three runs leave nothing to learn from. By how much intervals are widened, and which
    loads count as seen, stays as of all runs: the errors are those of a new load, the coverage is a little kinder.
    """
    without: Mapping[int, Any] = outcome.cross_spectrum_without
    if estimator == "ratio_index":
        without = outcome.ratio_index.without if outcome.ratio_index else {}
    whole = outcome.file.for_core()
    return [
        one
        for run in (split.identification for split in outcome.split)
        if run.number in without
        for one in judge(run, replace(whole, **{estimator: without[run.number]}), estimator)
    ]
