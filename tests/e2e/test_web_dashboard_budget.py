"""Why an estimate is uncertain, on the dashboard: each source with its part, and what would narrow it."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.browser import expect
from support.dashboard import CONTRASTS, LEAST_CONTRAST, STATUS, Look, Watched
from support.estimates import make_estimate
from support.web import Gateway

from gateway.estimates.budget import BudgetLine, budget_of
from gateway.estimates.posterior import Posterior, Source


@pytest.fixture
def gateway(tmp_path: Path) -> Iterator[Gateway]:
    with Gateway(tmp_path / "store") as opened:
        opened.status = STATUS
        yield opened


POSTERIOR = Posterior(
    np.array([300.0, 50.0]),
    np.diag([7.0**2, 0.2**2]),
    {
        Source.CALIBRATION: np.array([[15.0, 0.10], [-4.0, 0.15]]),
        Source.GOODS: np.array([[22.0, 0.12]]),
        Source.LOAD_LENGTH: np.array([[22.0, 0.12]]),
        Source.DAY: np.array([[7.0, 0.05]]),
        Source.SENSOR: np.array([[6.0, 0.04]]),
        Source.EMPTY_SHARE: np.array([[0.0, 0.4]]),
        Source.MODEL: np.array([[5.0, 0.0], [0.0, 0.1]]),
    },
)


def test_error_sources_are_listed_largest_first(gateway: Gateway, watched: Watched, dashboard: Look) -> None:
    budget = budget_of(POSTERIOR, is_shape_said=False)
    of_grams = replace(budget[-1], payload_kg=0.2)
    gateway.publish(replace(make_estimate(0).answered(POSTERIOR), error_budget=(*budget, of_grams)))
    page = dashboard()
    half = round(1.96 * POSTERIOR.std(0))
    expect(page.locator("#budget-why")).to_have_text(f"Why ± {half} kg?")
    expect(page.locator("#budget")).to_have_attribute("open", "")  # there is room for it
    first = page.locator("#budget-lines li").first
    expect(first).to_have_text(re.compile(r"vehicle's loads\s*±\s43\skg"))
    remedies = page.locator("#budget-remedies li")
    said = remedies.all_inner_texts()
    assert len({*said}) == len(said) == len({line.remedy for line in budget if helps(line, POSTERIOR.std(0))})
    expect(page.locator("#budget-remedies")).to_contain_text("State in the vehicle's data what it carries")
    expect(remedies.first).to_contain_text(f"± {half} kg becomes ± ")
    assert page.locator("#budget-lines li").count() == sum(line.payload_kg > 0.0 for line in budget)  # no ± 0 kg
    assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
    assert [said for said in watched.complaints if "ERR_FAILED" not in said] == []  # the charts' library


def helps(line: BudgetLine, std_kg: float) -> bool:
    """Whether a remedy narrows the interval by a tenth."""
    return line.remedy is not None and line.payload_with_remedy_kg < 0.9 * std_kg
