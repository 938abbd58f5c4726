"""A calibration file compared with another, and with the campaign and the logs that it was made from.

A figure has a standard deviation and the unit that its name ends in. Stated facts are compared directly, fitted figures
in combined standard deviations.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

import numpy as np

from gateway.calibration.campaign import Campaign, file_sha256
from gateway.calibration.file.calibration_file import CalibrationFile
from gateway.calibration.file.parts import RunPart
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.parameters import is_positive
from gateway.core.ratio_index.regression import RegressionModel

# Fitted arrays: compared as figures. The rest of these names is identity, which says nothing by itself.
_LEFT_OUT: Final = frozenset({"id", "parameters", "covariance", "names", "coefficients",
                              "gram_inverse", "terms", "information", "pull"})  # fmt: skip


@dataclass(frozen=True, slots=True)
class FittedFigure:
    """One parameter with its posterior standard deviation.

    A positive quantity was fitted by its logarithm, and is compared on that scale.
    """

    name: str
    centre: float
    std: float
    is_positive: bool = False

    def distance(self, other: "FittedFigure") -> float:
        """Distance of two such figures, in standard deviations of their difference; inf if both are exact."""
        if self.is_positive and other.is_positive:
            apart = math.log(self.centre / other.centre)
            combined = math.hypot(self.std / self.centre, other.std / other.centre)
        else:
            apart, combined = self.centre - other.centre, math.hypot(self.std, other.std)
        if apart == 0.0:
            return 0.0
        return abs(apart) / combined if combined > 0.0 else math.inf


def figures_of(file: CalibrationFile) -> dict[str, tuple[FittedFigure, ...]]:
    """By part of the file: half-car parameters of cross_spectrum, regressions of ratio_index (constant first)."""
    figures = {}
    if file.cross_spectrum is not None:
        figures["cross_spectrum"] = _half_car(file.cross_spectrum)
    if file.ratio_index is not None:
        for target in ("payload", "front_share"):
            model = getattr(file.ratio_index, target)
            if model is not None:
                figures[f"ratio_index.{target}"] = _regression(model)
    return figures


def _half_car(part: CrossSpectrumCalibration) -> tuple[FittedFigure, ...]:
    """Parameter values; a parameter stored as a logarithm has its standard deviation to first order."""
    stds = np.sqrt(np.diag(part.covariance))
    figures = []
    for name, entry, std in zip(part.names, part.parameters.tolist(), stds.tolist(), strict=True):
        scale = math.exp(entry) if is_positive(name) else 1.0
        figures.append(FittedFigure(name, scale if is_positive(name) else entry, scale * std, is_positive(name)))
    return tuple(figures)


def _regression(part: RegressionModel) -> tuple[FittedFigure, ...]:
    """Constant and coefficients of the unscaled terms, in the target's unit: comparable whatever the scaling.

    The file has them of columns scaled to [-1, 1] by lows l and highs h:
    b_0 + sum b_i (2 x_i - h_i - l_i) / (h_i - l_i). With T for the step from these b to those of x, Var = s^2 T
    (X'X)^-1 T'.
    """
    span = part.highs - part.lows
    to_raw = np.diag(np.r_[1.0, 2.0 / span])
    to_raw[0, 1:] = -(part.highs + part.lows) / span
    centres = to_raw @ part.coefficients
    stds = part.residual_std * np.sqrt(np.diag(to_raw @ part.gram_inverse @ to_raw.T))
    rows = zip(("constant", *part.terms), centres.tolist(), stds.tolist(), strict=True)
    return tuple(FittedFigure(name, centre, std) for name, centre, std in rows)


@dataclass(frozen=True, slots=True)
class Difference:
    """One difference between two files. ``n_std``: in combined standard deviations; None for a plain fact.

    ``one`` and ``other`` are as in the files; None if that file does not have the place.
    """

    where: str
    one: Any
    other: Any
    n_std: float | None = None


def differences(one: CalibrationFile, other: CalibrationFile) -> tuple[Difference, ...]:
    """All differences: plain facts in the order of the file, then fitted figures, the most different first."""
    fitted = sorted(_fitted(one, other), key=lambda difference: -(difference.n_std or 0.0))
    return (*_plain(one, other), *fitted)


def _plain(one: CalibrationFile, other: CalibrationFile) -> Iterator[Difference]:
    """If one file lacks a whole part, such as the line that the other inherited from, its first fact represents all."""
    mine, its = (file.model_dump(mode="json") for file in (one, other))
    lacked = {name for name in mine if (mine[name] is None) != (its[name] is None)}
    ours, theirs = dict(_leaves(mine)), dict(_leaves(its))
    told = set()
    for where in dict.fromkeys([*ours, *theirs]):
        part = where.partition(".")[0]
        if ours.get(where) == theirs.get(where) or (part in lacked and part in told):
            continue
        told.add(part)
        yield Difference(where, ours.get(where), theirs.get(where))


def _leaves(content: Any, where: str = "") -> Iterator[tuple[str, Any]]:
    """Every fact of a JSON object with its place; tables in lists are counted from 1."""
    if isinstance(content, dict):
        for key, part in content.items():
            if key not in _LEFT_OUT:
                yield from _leaves(part, f"{where}.{key}" if where else key)
    elif isinstance(content, list) and any(isinstance(part, dict) for part in content):
        for number, part in enumerate(content, 1):
            yield from _leaves(part, f"{where}[{number}]")
    else:
        yield where, content


def _fitted(one: CalibrationFile, other: CalibrationFile) -> Iterator[Difference]:
    ours, theirs = _by_place(one), _by_place(other)
    for where in dict.fromkeys([*ours, *theirs]):
        a, b = ours.get(where), theirs.get(where)
        if a is None or b is None:
            yield Difference(where, a and a.centre, b and b.centre)
        elif (a.centre, a.std) != (b.centre, b.std):
            yield Difference(where, a.centre, b.centre, a.distance(b))


def _by_place(file: CalibrationFile) -> dict[str, FittedFigure]:
    return {f"{part}.{figure.name}": figure for part, figures in figures_of(file).items() for figure in figures}


class CheckResult(StrEnum):
    """The result of a check. A note does not affect the numbers."""

    GOOD = "good"
    NOTE = "note"
    FAULT = "fault"


@dataclass(frozen=True, slots=True)
class Check:
    """One checked item."""

    what: str
    verdict: CheckResult
    text: str


def check_against_campaign(file: CalibrationFile, campaign: Campaign) -> tuple[Check, ...]:
    """Logs, loads and campaign file compared with the calibration's record of them."""
    return (_campaign_file(file, campaign), *(_run(run, campaign) for run in file.provenance.runs))


def _campaign_file(file: CalibrationFile, campaign: Campaign) -> Check:
    if file_sha256(campaign.path) == file.provenance.campaign_sha256:
        return Check("campaign", CheckResult.GOOD, f"{campaign.path} is the one it was made from")
    return Check(
        "campaign", CheckResult.NOTE, f"{campaign.path} was changed since, or is another: its runs are checked"
    )


def _run(run: RunPart, campaign: Campaign) -> Check:
    what = f"run {run.number}"
    if run.number > len(campaign.runs):
        return Check(what, CheckResult.FAULT, f"{run.log}: the campaign has {len(campaign.runs)} runs only")
    stated = campaign.runs[run.number - 1]
    log = campaign.log_of(stated)
    sha256 = _hash_of(log)
    if sha256 is None:
        return Check(what, CheckResult.FAULT, f"{log}: cannot be read")
    if sha256 != run.sha256:
        return Check(what, CheckResult.FAULT, f"{log}: not the log it was calibrated from (sha256 {sha256[:12]}...)")
    if stated.payload_kg != run.payload_kg or campaign.front_share_pct(stated) != run.front_share_pct:
        return Check(
            what,
            CheckResult.FAULT,
            f"{log}: calibrated as {run.payload_kg:g} kg and {run.front_share_pct:.4g} %, the campaign says "
            f"{stated.payload_kg:g} kg and {campaign.front_share_pct(stated):.4g} %",
        )
    return Check(what, CheckResult.GOOD, f"{log}")


def _hash_of(log: Path) -> str | None:
    try:
        return file_sha256(log)
    except OSError:
        return None
