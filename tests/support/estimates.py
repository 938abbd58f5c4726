"""Estimates to store, publish and ask for."""

from dataclasses import replace
from typing import Any

import numpy as np

from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Epoch, Estimate, Quantity, Weight, Weights
from gateway.estimates.budget import budget_of
from gateway.estimates.posterior import Posterior, Source
from gateway.records import Spectra, Why, json_line
from gateway.units import NS_PER_S

WINDOW_NS = 300 * NS_PER_S


def posterior_of(
    payload_kg: float, share_pct: float, std_kg: float, share_std_pct: float, cg_left_m: float | None = None
) -> Posterior:
    """A posterior without correlations: half of each variance is the batch's own, half the model's error."""
    mean = np.array([payload_kg, share_pct, *([] if cg_left_m is None else [cg_left_m])])
    std = np.array([std_kg, share_std_pct, 0.004])[: len(mean)]
    return Posterior(mean, np.diag(0.5 * std**2), {Source.MODEL: np.diag(np.sqrt(0.5) * std)})


def make_estimate(n: int, *rejected: Why, with_spectra: bool = False, is_provisional: bool = False) -> Estimate:
    """The n-th 5-minute batch since 1970: an answer of 100 + n kg, or a rejection."""
    has_answer = not rejected
    payload_kg = 100.0 + n if has_answer else float("nan")
    return Estimate(
        t_start_ns=n * WINDOW_NS,
        t_end_ns=(n + 1) * WINDOW_NS,
        estimator="ratio_index",
        calibration_id="sha256:ab",
        payload=Quantity(payload_kg, 6.0, (payload_kg - 12.0, payload_kg + 12.0)) if has_answer else Quantity(),
        front_share=Quantity(50.5) if has_answer else Quantity(),
        mean_speed_mps=14.0,
        gap_share=0.0,
        rejected=rejected,
        is_provisional=is_provisional,
        spectra=Spectra(*(np.linspace(0.1 * k, 1.0, 4) for k in range(5))) if with_spectra else None,
        posterior=posterior_of(payload_kg, 50.5, 6.0, 0.2) if has_answer else None,
        vehicle_id="van-17",
    )


def with_everything(n: int) -> Estimate:
    """The n-th batch with an epoch, a budget, weights, a place to the side, and diagnostics."""
    found = make_estimate(n)
    known = posterior_of(100.0 + n, 50.5, 6.0, 0.2, 0.021)
    return replace(
        found,
        epoch=Epoch(Quantity(101.0 / 3.0, 4.0), Quantity(50.2, 0.1), 3, Quantity(0.01, 0.003)),
        posterior=known,
        error_budget=budget_of(known, is_shape_said=False),
        weights=Weights(gross=Weight(1711.3, 6.1, 2000.0, None), front_axle=Weight(1006.1, 5.4, 1000.0, None)),
        cg_left=Quantity.normal(0.021, 0.004),
        shares={"gap": 0.01, "too_slow": 1.0 / 3.0},
        diagnostics={"damper_front_ratio": 1.03, "tension": float("nan")},
        vin="WF0XXXTTGXJK12345",
    )


def make_record(n: int, *rejected: Why, **kind: bool) -> dict[str, Any]:
    return estimate_to_json(make_estimate(n, *rejected, **kind))


def texts(*records: dict[str, Any]) -> tuple[str, ...]:
    return tuple(json_line(record) for record in records)
