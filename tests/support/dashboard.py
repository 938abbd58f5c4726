"""A gateway with something to look at, and a browser page that keeps count of what it did."""

import time
from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from gateway.calibration.file import load_calibration
from gateway.core.fusion import epoch_of
from gateway.estimates.batch_estimate import Estimate
from gateway.records import Why, iso_utc
from gateway.status import BusStatus, SignalHealth, State, Status, StoreStatus, UplinkStatus
from gateway.web.routes.weights import KnownLoadTold
from gateway.weighing.calibrated import CalibratedVehicle
from support.estimates import WINDOW_NS, make_estimate, posterior_of
from support.patience import PATIENCE_S
from support.web import Gateway

STATUS = Status(
    version="1.2.3",
    state=State.ESTIMATING,
    uptime_s=3600.0,
    vehicle_id="van-17",
    calibration_id="sha256:ab",
    estimator="cross_spectrum",
    bus=BusStatus(interface="socketcan", channel="can0", state="receiving", n_frames=12345),
    signals=(
        SignalHealth(signal="vertical_acceleration", rate_hz=100.2, last_age_s=0.0, rejected_share=0.01),
        SignalHealth(signal="pitch_rate", rate_hz=100.0, last_age_s=75.0, rejected_share=0.0),
        SignalHealth(signal="speed"),
        SignalHealth(signal="door"),
        SignalHealth(signal="odometer"),
    ),
    store=StoreStatus(),
    uplink=UplinkStatus(broker="fleet.example:8883", is_connected=True, n_waiting=31, waiting_age_s=9300.0),
)
TRUTH = tuple(
    KnownLoadTold(t_start=iso_utc(t_ns), payload_kg=kg, front_share_pct=pct)
    for t_ns, kg, pct in ((0, 0.0, 50.0), (2 * WINDOW_NS, 270.0, 48.0))
)


def demo_calibration() -> CalibratedVehicle:
    """The demonstration's, with limits: 300 kg behind the axle's middle are too much for the rear one."""
    shipped = load_calibration(Path(str(files("gateway"))) / "demo" / "paper_van.json").for_core()
    limits = {"gross_limit_kg": 2000.0, "front_axle_limit_kg": 1000.0, "rear_axle_limit_kg": 850.0}
    return replace(shipped, vehicle=replace(shipped.vehicle, **limits))


def weighed(n: int, payload_kg: float, front_share_pct: float, calibrated: CalibratedVehicle) -> Estimate:
    """The n-th batch as the cross-spectral estimator would answer."""
    return replace(
        make_estimate(n).answered(posterior_of(payload_kg, front_share_pct, 6.0, 0.2)),
        estimator="cross_spectrum",
        calibration_id=calibrated.id,
        epoch=epoch_of(posterior_of(payload_kg, front_share_pct, 4.0, 0.15), 2),
    )


def furnished(directory: Path) -> Gateway:
    """Two batches empty, one rejected, then 270 kg; the truth beside them."""
    calibrated = demo_calibration()
    gateway = Gateway(directory, calibrated=calibrated, known_loads=lambda: TRUTH)
    gateway.status = STATUS
    refused, loaded = make_estimate(2, Why.TOO_SLOW, Why.GAP), weighed(3, 270.0, 48.0, calibrated)
    batches = [*(weighed(n, 2.0, 50.0, calibrated) for n in range(2)), refused, loaded]
    gateway.publish(*batches)
    return gateway


Look = Callable[[], Any]  # opens a page -> the page


class Watched:
    """A page, what it loaded from where, and what its console said."""

    def __init__(self, browser: Any, **options: Any) -> None:
        self.page = browser.new_page(**{"locale": "en-GB", "timezone_id": "UTC", **options})
        self.page.set_default_timeout(1000 * PATIENCE_S)
        self.addresses: list[str] = []
        self.complaints: list[str] = []
        self.page.on("request", lambda request: self.addresses.append(request.url))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("console", lambda said: self.complaints.append(said.text) if said.type == "error" else None)

    def opened(self, url: str) -> Any:
        """The page once it shows the stored records."""
        self.page.goto(url)
        return self.page

    def wait_for_charts(self) -> None:
        """Waits until the last chart is drawn."""
        for chart in ("#payload-chart", "#share-chart"):
            self.page.wait_for_selector(f"{chart}[data-drawn]")

    def wait_until(self, condition: str) -> None:
        """Waits until a JavaScript expression holds; playwright's own way needs eval, which the page forbids."""
        end_s = time.monotonic() + PATIENCE_S
        while not self.page.evaluate(condition):
            assert time.monotonic() < end_s, f"it did not come true that {condition}"
            self.page.wait_for_timeout(50)


LEAST_CONTRAST = 4.5  # WCAG 2.2, level AA

# Charts follow the page's colours a few frames later.
CHARTS_FOLLOW = """(() => {
  const probe = document.body.appendChild(document.createElement("span"));
  probe.style.color = "var(--soft)";
  const soft = getComputedStyle(probe).color;
  probe.remove();
  const ticks = [...document.querySelectorAll("[data-drawn] .xtick text")];
  return ticks.length > 0 && ticks.every((tick) => getComputedStyle(tick).fill === soft);
})()"""

# Every text that can be seen: [contrast (WCAG 2.2, 1.4.3), text], its colour over the grounds below it.
CONTRASTS = """() => {
  const channels = (colour) => { const [r, g, b, a = 1] = colour.match(/[\\d.]+/g).map(Number); return [r, g, b, a]; };
  const over = (top, below) => below.map((c, i) => top[3] * top[i] + (1 - top[3]) * c);
  const luminance = (rgb) => rgb.map((c) => c / 255)
    .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4))
    .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
  const groundOf = (element) => {
    const grounds = [];
    for (let e = element; e; e = e.parentElement) grounds.push(channels(getComputedStyle(e).backgroundColor));
    return grounds.reverse().reduce((below, ground) => over(ground, below), [255, 255, 255]);
  };
  const found = [];
  for (const element of document.body.querySelectorAll("*")) {
    const text = [...element.childNodes].filter((n) => n.nodeType === 3).map((n) => n.textContent.trim()).join("");
    if (!text || !element.checkVisibility({ visibilityProperty: true, opacityProperty: true })) continue;
    const style = getComputedStyle(element);
    const ground = groundOf(element);
    const ink = over(channels(element instanceof SVGElement ? style.fill : style.color), ground);
    const [dark, light] = [luminance(ink), luminance(ground)].sort((a, b) => a - b);
    found.push([(light + 0.05) / (dark + 0.05), text]);
  }
  return found;
}"""
