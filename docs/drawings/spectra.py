"""What the springs say: spectra of one simulated van on one road, empty and loaded."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from drawings.canvas import Canvas, Point
from gateway.core.spectrum import frequencies_hz, segment_transforms
from gateway.records import F64
from gateway.sim.scenario import simulate_drive
from gateway.workbench.simulate import bench_of

KIND: Final = "experiment"
EMPTY: Final = 0  # drives of that campaign: nothing,
LOADED: Final = 8  # and 420 kg near the centre of gravity
ROAD_SEED: Final = 1  # both drive the same road
DURATION_S: Final = 300.0
SEGMENT_S: Final = 5.12
BAND_HZ: Final = (1.0, 15.0)
ACCEL_Z: Final = 2
PITCH: Final = 1

LEFT: Final = 90.0
RIGHT: Final = 800.0
PANEL_HEIGHT: Final = 150.0
TOPS: Final = (60.0, 265.0, 470.0)
TICKS_HZ: Final = (1, 2, 3, 4, 6, 8, 10, 15)


def _spectra(number: int) -> tuple[F64, F64, F64, float]:
    """freq_hz, amplitude densities (m,) of acceleration and pitch rate, and the payload, kg."""
    bench = bench_of(KIND, longest_s=DURATION_S)
    planned = bench.plan().drives[number]
    driven = simulate_drive(bench.vehicle, planned.steps, planned.road, planned.drive, bench.sensors, ROAD_SEED)
    recording = driven.recording
    rate_hz = 1e9 / float(np.median(np.diff(recording.imu_t_ns)))
    n_segment = round(SEGMENT_S * rate_hz)
    starts = np.arange(0, len(recording.imu_t_ns) - n_segment, n_segment // 2)
    freq_hz = frequencies_hz(n_segment, rate_hz)
    is_drawn = (freq_hz >= BAND_HZ[0]) & (freq_hz <= BAND_HZ[1])
    columns = (recording.accel_mps2[:, ACCEL_Z], recording.gyro_radps[:, PITCH])
    power = [np.mean(np.abs(segment_transforms(x, starts, n_segment, rate_hz)) ** 2, axis=0) for x in columns]
    acceleration, pitch_rate = (np.sqrt(each[is_drawn]) for each in power)
    return freq_hz[is_drawn], acceleration, pitch_rate, float(driven.truth.payload_kg[0])


def _x(freq_hz: float) -> float:
    low, high = BAND_HZ
    return LEFT + (RIGHT - LEFT) * math.log(freq_hz / low) / math.log(high / low)


def _panel(sheet: Canvas, top: float, title: str, freq_hz: F64, lines: Sequence[tuple[F64, str]]) -> None:
    """Amplitudes over frequency, both logarithmic; whole decades and their halves are marked."""
    low, high = (limit(each.min() if limit is min else each.max() for each, _ in lines) for limit in (min, max))
    low, high = low / 1.15, high * 1.15
    bottom = top + PANEL_HEIGHT

    def y(amplitude: float) -> float:
        return bottom - PANEL_HEIGHT * math.log(amplitude / low) / math.log(high / low)

    sheet.text(LEFT, top - 10, title, style="bold", anchor="start")
    marks = [m * 10.0**k for k in range(-6, 4) for m in (1, 2, 5)]
    for mark in (m for m in marks if low < m < high):
        sheet.line([(LEFT, y(mark)), (RIGHT, y(mark))], "soft", width=0.3)
        sheet.text(LEFT - 8, y(mark) + 4, f"{mark:g}", ink="soft", style="small", anchor="end")
    for tick in TICKS_HZ:
        sheet.line([(_x(tick), bottom), (_x(tick), bottom + 5)], "soft")
        sheet.text(_x(tick), bottom + 19, f"{tick} Hz" if tick == TICKS_HZ[0] else str(tick), ink="soft", style="small")
    sheet.line([(LEFT, top), (LEFT, bottom), (RIGHT, bottom)], "soft")
    for amplitudes, ink in lines:
        points: list[Point] = [(_x(f), y(a)) for f, a in zip(freq_hz.tolist(), amplitudes.tolist(), strict=True)]
        sheet.line(points, ink, width=1.8)


def _key(sheet: Canvas, x: float, words: str, ink: str) -> None:
    sheet.line([(x, 24), (x + 30, 24)], ink, width=2.5)
    sheet.text(x + 38, 28, words, ink=ink, anchor="start")


def spectra() -> str:
    """The drawing as SVG."""
    sheet = Canvas(840, 660, "Spectra of vertical acceleration and pitch rate, empty and loaded, and their ratio")
    freq_hz, *empty, nothing_kg = _spectra(EMPTY)
    _, *loaded, load_kg = _spectra(LOADED)
    _key(sheet, LEFT, f"{nothing_kg:.0f} kg", "blue")
    _key(sheet, LEFT + 130, f"{load_kg:.0f} kg", "orange")
    titles = ("Vertical acceleration, m/s²/√Hz", "Pitch rate, rad/s/√Hz")
    for top, title, light, heavy in zip(TOPS[:2], titles, empty, loaded, strict=True):
        _panel(sheet, top, title, freq_hz, ((light, "blue"), (heavy, "orange")))
    ratios = [
        (pitch_rate / acceleration, ink) for (acceleration, pitch_rate), ink in ((empty, "blue"), (loaded, "orange"))
    ]
    _panel(sheet, TOPS[-1], "Pitch rate over acceleration, rad/s per m/s²: the road divides out", freq_hz, ratios)
    return sheet.svg()
