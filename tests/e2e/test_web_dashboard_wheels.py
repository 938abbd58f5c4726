"""The dashboard where a roll rate tells the load's place across: an ellipse, and a number at every wheel."""

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.browser import expect
from support.dashboard import CONTRASTS, LEAST_CONTRAST, STATUS, Watched, demo_calibration, weighed
from support.web import Gateway, serving

from gateway.core.fusion import epoch_of
from gateway.core.vehicle import cg_left_m
from gateway.core.weights import on_the_road as weights
from gateway.estimates.batch_estimate import Estimate
from gateway.estimates.posterior import Posterior
from gateway.weighing.calibrated import CalibratedVehicle

PAYLOAD_KG, LEFT_M = 270.0, 0.3  # 54 kg more on the left wheels, 32.4 of them in front
ALONG, ACROSS = (290 - 96) / 2.8, 2 * 58 / 1.5  # pixels per metre of the drawing


def tracked() -> CalibratedVehicle:
    """The demonstration's, with wheels that may bear 430 kg each."""
    shipped = demo_calibration()
    limits = {"front_wheel_limit_kg": 430.0, "rear_wheel_limit_kg": 430.0}
    return replace(shipped, vehicle=replace(shipped.vehicle, track_width_m=1.5, **limits))


def leaning(n: int, calibrated: CalibratedVehicle, left_m: float = LEFT_M) -> Estimate:
    """The n-th batch with its payload that far left of the centre line."""
    whole_left_m = cg_left_m(calibrated.vehicle, PAYLOAD_KG, left_m)
    std = np.array([6.0, 0.6, 0.008])
    together = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.5], [0.0, 0.5, 1.0]])
    posterior = Posterior(np.array([PAYLOAD_KG, 48.0, whole_left_m]), np.outer(std, std) * together)
    answered = weighed(n, PAYLOAD_KG, 48.0, calibrated).answered(posterior)
    on_road = weights.weighed(replace(answered, roll_share_front=0.6, roll_share_front_std=0.05), calibrated.vehicle)
    return replace(on_road, epoch=epoch_of(posterior, 2))


@pytest.fixture(scope="module")
def gateway(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Gateway]:
    calibrated = tracked()
    with Gateway(tmp_path_factory.mktemp("wheels"), calibrated=calibrated) as opened:
        opened.status = STATUS
        opened.publish(weighed(0, PAYLOAD_KG, 48.0, calibrated), leaning(1, calibrated))
        yield opened


@pytest.fixture(scope="module")
def site(gateway: Gateway) -> Iterator[str]:
    with serving(gateway.app) as server:
        yield server.url
        gateway.board.close()


def test_every_wheel_has_its_load_and_the_load_lies_to_scale_in_its_ellipse(site: str, watched: Watched) -> None:
    page = watched.page
    page.goto(site)
    drawing = page.get_by_role("img", name=re.compile(r"front left wheel 435 ± \d+ kg \(limit 430 kg\)"))
    expect(drawing).to_be_visible()
    expect(page.locator("#van text.on-wheel")).to_have_count(4)
    expect(page.locator("#van rect.wheel.over")).to_have_count(2)
    expect(page.locator("#van text.on-wheel.over").first).to_contain_text("435 ±")
    expect(page.locator("#overload")).to_contain_text("front left wheel", ignore_case=True)
    expect(page.locator("#overload")).not_to_contain_text("front right wheel", ignore_case=True)
    disc = page.locator("#van circle.load")
    across_px = float(disc.get_attribute("cy") or "nan") - 96.0
    assert across_px / ACROSS == pytest.approx(LEFT_M, abs=0.01)
    expect(page.locator("#weights")).to_contain_text("0.30 ± 0.09 m left of the centre line")
    drawing = page.get_by_role("img", name="m behind the front axle, 0.30 m left of the centre line. Front axle")
    expect(drawing).to_have_attribute(
        "aria-label", re.compile(r"front left wheel 435 ± \d+\skg.*, front right wheel \d+ ± ")
    )

    # the ellipse is that of the covariance: half axes and direction by its eigenvectors in pixels
    drawn = page.locator("#van ellipse.spread")
    vehicle, found = tracked().vehicle, leaning(1, tracked())
    assert found.posterior is not None
    place = weights.place_of(vehicle, found.posterior)
    along, across = place.std_m * ALONG, place.left_std_m * ACROSS
    common = place.correlation * along * across
    variances, axes = np.linalg.eigh([[along**2, common], [common, across**2]])
    half_axes = [float(drawn.get_attribute(name) or "nan") for name in ("rx", "ry")]
    assert half_axes == pytest.approx(np.sqrt(5.991 * variances[::-1]), rel=0.02)
    degrees = float(re.findall(r"rotate\((\S+)", drawn.get_attribute("transform") or "")[0])
    expected = math.degrees(math.atan2(axes[1, 1], axes[0, 1]))
    assert math.sin(math.radians(degrees - expected)) == pytest.approx(0.0, abs=0.02)


def test_the_history_shows_where_the_centre_of_gravity_was(site: str, browser: Any) -> None:
    watched = Watched(browser, color_scheme="light")
    page = watched.page
    page.goto(site)
    page.wait_for_selector("#side-chart[data-drawn]")
    expect(page.locator("#side-chart-words")).to_contain_text("1 of 2 batches weighed; the last 0.054 m")
    page.get_by_text("History as a table").click()
    expect(page.locator("#side-head")).to_be_visible()
    expect(page.locator("#recent tr").nth(0)).to_contain_text("0.054 ± 0.016 m")
    expect(page.locator("#recent tr").nth(1)).to_contain_text("unknown")
    assert [text for contrast, text in page.evaluate(CONTRASTS) if contrast < LEAST_CONTRAST] == []
    page.set_viewport_size({"width": 360, "height": 740})
    watched.wait_until("document.documentElement.scrollWidth <= 360")
    assert watched.complaints == []
    page.close()


def test_without_a_roll_rate_it_says_why_no_wheel_is_weighed(tmp_path: Path, watched: Watched) -> None:
    calibrated = tracked()
    with Gateway(tmp_path / "store", calibrated=calibrated) as gateway, serving(gateway.app) as server:
        gateway.publish(weighed(0, PAYLOAD_KG, 48.0, calibrated))
        page = watched.page
        page.goto(server.url)
        expect(page.locator("#weights")).to_contain_text(
            "Wheelsunknown: the lateral position of the load needs a roll rate"
        )
        expect(page.locator("#van text.on-wheel")).to_have_count(0)
        expect(page.locator("#van ellipse")).to_have_count(0)
        expect(page.locator("#van rect.spread")).to_have_count(1)
        expect(page.locator("#side-head")).to_be_hidden()
        gateway.board.close()
