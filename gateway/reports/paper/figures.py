"""The figures of the paper's section 4, of our experiments."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from gateway.calibration.judgement.evaluation import Judged, Target
from gateway.calibration.ratio_index.least_squares import fit_regression
from gateway.calibration.ratio_index.spectra_table import N_SEGMENT, index_rows
from gateway.calibration.stated_drive import StatedDrive
from gateway.core.ratio_index.index import PAPER_BANDS, band_pass_gain, mean_spectrum
from gateway.core.ratio_index.regression import MODEL_9_PAYLOAD, MODEL_10_FRONT_SHARE
from gateway.records import F64
from gateway.reports.charts import COLOURS, GREY, Axis, Chart, LineMark, Mark, Marker, Panel, Points, Rule, Section
from gateway.reports.paper.experiments import Experiments
from gateway.units import NS_PER_S

ACCELERATION: Final = "acceleration"
PITCH_RATE: Final = "pitch_rate"
_SPECTRUM: Final = {
    ACCELERATION: Axis("vertical acceleration [m/s²/√Hz]"),
    PITCH_RATE: Axis("pitch rate [rad/s/√Hz]"),
}
_FREQUENCY, _TIME = Axis("frequency [Hz]"), Axis("time [min]")
_TITLES: Final[dict[Target, str]] = {"payload": "payload [kg]", "front_share": "front share [%]"}
_LOAD, _SHARE = (Axis(title) for title in _TITLES.values())


def figures_of(experiments: Experiments) -> list[Section]:
    """Every figure with its heading and what it shows, in the order of the paper."""
    figures: list[tuple[str, str, str, Iterator[Panel]]] = [
        (
            "fig01_spectra",
            "Fig. 1: spectra for several loads and several distributions",
            "More load lowers and weakens the body's resonance; moving it changes the pitch resonance.",
            _spectra(experiments),
        ),
        (
            "table2_bands",
            "Table 2: where the spectra differ, J_L (4) and J_D (5)",
            "Averages over narrow w are always the largest, and the noisiest: 0.05 Hz is the floor of a grid, no "
            "optimum. The bands belong to the vehicle, so calibration finds them; the paper's stand beside.",
            _bands(experiments),
        ),
        ("fig02_filtered", "Fig. 2: empty and full, through the two band-passes (6)", "", _filtered(experiments)),
        (
            "fig03_04_index",
            "Fig. 3 and 4: R_a against the load alone, R_g against the share alone",
            "Lines are the static regressions (9) and (10) fitted to these batches.",
            _index_and_fit(experiments),
        ),
        (
            "fig05_06_grid",
            "Fig. 5 and 6: the conditions explored and the two indexes over them",
            "",
            _grid(experiments),
        ),
        (
            "fig07_fit",
            "Fig. 7: the joint model (11) on the grid it was identified on",
            "In-sample, as in the paper.",
            _estimated_over_true(
                [(one.label, one.judge(experiments.driven["ident"].runs), "circle") for one in experiments.simulated]
            ),
        ),
        (
            "fig08_09_road",
            "Fig. 8 and 9: roughness and speed",
            "The paper takes the dashed lines of Fig. 9 for the whole effect of speed. The rear axle meets the same "
            "road a wheelbase later, |cos(pi f l / v)|: heave has zeros at (n + 1/2) v / l, pitch at n v / l, and they "
            "wander through the very bands that the index compares.",
            _roads(experiments),
        ),
        *(
            (
                f"fig{10 + n}_test{n + 1}",
                f"Fig. {10 + n}: test {n + 1}",
                "Grey: the truth. Points: batches with their 95 % intervals. The load changes at a stop.",
                _over_time(experiments, f"test{n + 1}"),
            )
            for n in range(3)
        ),
        ("fig13_experiment", "Fig. 13: the experimental grid", "", _experimental_grid(experiments)),
        (
            "fig14_experiment",
            "Fig. 14: the experimental protocol, simulated",
            "",
            _estimated_over_true(
                [
                    (f"{one.label}, {part}", one.judge(runs), marker)
                    for one in experiments.experimental
                    for part, runs, marker in _parts_of_experiment(experiments)
                ]
            ),
        ),
    ]
    return [
        Section(name, heading, (), (Chart(name, text, heading, tuple(panels)),))
        for name, heading, text, panels in figures
    ]


def spectrum_of(run: StatedDrive, sensor: str) -> tuple[F64, F64]:
    """Mean amplitude spectrum over a run's batches: frequencies (m,) and amplitudes (m,), NaN if no batch is usable."""
    freq_hz, total, n = np.arange(1.0, 205.0) * (50.0 / N_SEGMENT), np.zeros(204), 0
    for batch in run.batches:
        x = batch.vertical_acceleration_mps2 if sensor == ACCELERATION else batch.pitch_rate_radps
        spectrum = mean_spectrum(x, batch.usable, N_SEGMENT, batch.rate_hz)
        if spectrum is not None:
            freq_hz, total, n = spectrum[0], total + spectrum[1], n + 1
    return freq_hz, total / n if n else np.full(len(freq_hz), np.nan)


def _spectra(experiments: Experiments) -> Iterator[Panel]:
    """The spectra of acceleration for several loads, and of pitch rate for several shares."""
    by_load = [(f"{run.payload_kg:.0f} kg", run) for run in experiments.driven["load-sweep"].runs[::3]]
    by_share = [(f"{run.front_share_pct:.0f} %", run) for run in experiments.driven["share-sweep"].runs[::4]]
    for sensor, named in ((ACCELERATION, by_load), (PITCH_RATE, by_share)):
        lines = (LineMark(*spectrum_of(run, sensor), name, _colour(k)) for k, (name, run) in enumerate(named))
        yield Panel(_FREQUENCY, _SPECTRUM[sensor], tuple(lines))


def band_differences(experiments: Experiments, sensor: str, width_hz: float) -> tuple[F64, F64]:
    """(4) or (5): frequencies (m,) and J (m,) between the extremes of the sensor's sweep."""
    runs = experiments.driven["load-sweep" if sensor == ACCELERATION else "share-sweep"].runs
    (freq_hz, low), (_, high) = spectrum_of(runs[0], sensor), spectrum_of(runs[-1], sensor)
    n = max(round(width_hz / (freq_hz[1] - freq_hz[0])), 1)
    return freq_hz, np.convolve(high - low, np.full(n, 1.0 / n), mode="same")


def _bands(experiments: Experiments) -> Iterator[Panel]:
    """J_L and J_D over frequency, with the bands of our calibration and of the paper."""
    own = experiments.ratio_index
    chosen = {ACCELERATION: own.acceleration_bands, PITCH_RATE: own.pitch_rate_bands}
    for sensor, name in ((ACCELERATION, "J_L"), (PITCH_RATE, "J_D")):
        marks: list[Mark] = [
            LineMark(*band_differences(experiments, sensor, width_hz), f"{name}, w = {width_hz:g} Hz", colour)
            for width_hz, colour in ((0.05, GREY), (0.5, 0))
        ]
        for bands, colour, whose in ((chosen[sensor], 2, "ours"), (PAPER_BANDS[sensor], 1, "paper")):
            if bands is not None:
                over, under = bands
                marks.append(Rule(over.centre_hz, True, f"{whose}, over", colour))
                marks.append(Rule(under.centre_hz, True, f"{whose}, under", colour, "dash"))
        yield Panel(_FREQUENCY, Axis(f"{name} of {_SPECTRUM[sensor].title}"), (*marks, Rule(0.0)))


def _filtered(experiments: Experiments) -> Iterator[Panel]:
    """Spectra empty and full, unfiltered and through the two band-passes (6)."""
    runs = experiments.driven["load-sweep"].runs
    bands = experiments.ratio_index.acceleration_bands or PAPER_BANDS[ACCELERATION]
    for run in (runs[0], runs[-1]):
        freq_hz, spectrum = spectrum_of(run, ACCELERATION)
        passed = (
            LineMark(
                freq_hz, band_pass_gain(freq_hz, band) * spectrum, f"{band.centre_hz:g} Hz, w = {band.width_hz:g}", k
            )
            for k, band in enumerate(bands)
        )
        whole = LineMark(freq_hz, spectrum, "unfiltered", GREY)
        yield Panel(_FREQUENCY, _SPECTRUM[ACCELERATION], (whole, *passed), f"{run.payload_kg:.0f} kg")


def _index_and_fit(experiments: Experiments) -> Iterator[Panel]:
    """R_a against the load alone with (9), R_g against the share alone with (10)."""
    of_loads, of_shares = (
        index_rows(experiments.driven[kind].runs, experiments.ratio_index) for kind in ("load-sweep", "share-sweep")
    )
    for rows, name, index, axis, target, terms in (
        (of_loads, "R_a", of_loads.ra, _LOAD, of_loads.payload_kg, MODEL_9_PAYLOAD),
        (of_shares, "R_g", of_shares.rg, _SHARE, of_shares.front_share_pct, MODEL_10_FRONT_SHARE),
    ):
        model = fit_regression(terms, rows.ra, rows.rg, target, rows.run).model
        along = np.linspace(np.min(index), np.max(index), 60)
        fitted = np.array([model.predict(x, x)[0] for x in along])
        label = f"{' + '.join(terms)}, residual {model.residual_std:.2g}"
        yield Panel(Axis(name), axis, (Points(index, target, "batches"), LineMark(along, fitted, label, 1)))


def _grid(experiments: Experiments) -> Iterator[Panel]:
    """The explored conditions and both indexes over them; a colour is a share, and in the last panel a load."""
    rows = index_rows(experiments.driven["ident"].runs, experiments.ratio_index)
    load_kg, share_pct = rows.payload_kg, np.round(rows.front_share_pct)
    yield Panel(_LOAD, _SHARE, (Points(load_kg, rows.front_share_pct, colour=GREY),))
    yield Panel(_LOAD, Axis("R_a"), tuple(_by_level(load_kg, rows.ra, share_pct, "%")))
    yield Panel(_SHARE, Axis("R_g"), tuple(_by_level(rows.front_share_pct, rows.rg, np.round(load_kg), "kg")))


def _by_level(x: F64, y: F64, level: F64, unit: str) -> Iterator[Points]:
    for k, at in enumerate(np.unique(level).tolist()):
        yield Points(x[level == at], y[level == at], f"{at:.0f} {unit}", _colour(k))


def _roads(experiments: Experiments) -> Iterator[Panel]:
    """Spectra for two roughnesses; the road's low-pass (1) at several speeds, with and without the wheelbase filter."""
    named = [(iri, run) for iri in (2, 8) for run in experiments.driven["sensitivity"].runs if f"iri{iri}" in run.log]
    lines = (LineMark(*spectrum_of(run, ACCELERATION), f"IRI {iri}", k) for k, (iri, run) in enumerate(named))
    yield Panel(_FREQUENCY, _SPECTRUM[ACCELERATION], tuple(lines))
    freq_hz, marks = np.linspace(0.05, 10.0, 800), []
    wheelbase_m = experiments.driven["ident"].campaign.vehicle.wheelbase_m
    for k, kmh in enumerate((30.0, 50.0, 90.0)):
        speed_mps = kmh / 3.6
        road = 1.0 / np.abs(2j * np.pi * freq_hz + 0.15 * speed_mps)
        both_axles = road * np.abs(np.cos(np.pi * freq_hz * wheelbase_m / speed_mps))
        marks += [LineMark(freq_hz, road, "", k, "dash"), LineMark(freq_hz, both_axles, f"{kmh:.0f} km/h", k)]
    heave = Axis("road into heave: paper dashed, with the wheelbase solid", is_log=True, limits=(1e-4, 1.0))
    yield Panel(_FREQUENCY, heave, tuple(marks))


def _over_time(experiments: Experiments, kind: str) -> Iterator[Panel]:
    """Payload and share over time: the truth, and each method's batches with 95 % intervals."""
    runs = experiments.driven[kind].runs
    start_ns = runs[0].batches[0].t_start_ns
    judged = [
        (method.label, [one for one in method.judge(runs) if one.estimate.counted]) for method in experiments.simulated
    ]
    ends_ns = np.array([(run.batches[0].t_start_ns, run.batches[-1].t_end_ns, np.nan) for run in runs])  # with gaps
    true = {"payload": [run.payload_kg for run in runs], "front_share": [run.front_share_pct for run in runs]}
    for target, title in _TITLES.items():
        marks: list[Mark] = [LineMark(_minutes(ends_ns, start_ns).ravel(), np.repeat(true[target], 3), "truth", GREY)]
        for k, (label, told) in enumerate(judged):
            _, found, low, high = _compared(told, target)
            middle_ns = np.array([(one.estimate.t_start_ns + one.estimate.t_end_ns) / 2.0 for one in told])
            marks.append(Points(_minutes(middle_ns, start_ns), found, label, k, low=low, high=high))
        yield Panel(_TIME, Axis(title), tuple(marks))


def _minutes(t_ns: F64, start_ns: int) -> F64:
    return (t_ns - start_ns) / (60.0 * NS_PER_S)


def _experimental_grid(experiments: Experiments) -> Iterator[Panel]:
    runs = experiments.driven["experiment"].identification
    load_kg, share_pct = np.array([(run.payload_kg, run.front_share_pct) for run in runs]).reshape(-1, 2).T
    yield Panel(_LOAD, _SHARE, (Points(load_kg, share_pct, marker="square"),))


def _parts_of_experiment(experiments: Experiments) -> tuple[tuple[str, list[StatedDrive], Marker], ...]:
    driven = experiments.driven["experiment"]
    return ("identification", driven.identification, "circle"), ("validation", driven.validation, "square")


def _estimated_over_true(series: Sequence[tuple[str, list[Judged], Marker]]) -> Iterator[Panel]:
    """Estimates over the truth of several series of batches; on the grey line an estimate is exact."""
    for target, title in _TITLES.items():
        points = []
        for k, (label, judged, marker) in enumerate(series):
            true, found, *_ = _compared([one for one in judged if one.estimate.counted], target)
            points.append(Points(true, found, label, _colour(k), marker))
        every = np.concatenate([one.x for one in points])
        ends = np.array([every.min(), every.max()]) if every.size else every
        yield Panel(Axis(f"true {title}"), Axis(f"estimated {title}"), (LineMark(ends, ends, "exact", GREY), *points))


def _compared(judged: Sequence[Judged], target: Target) -> F64:
    """(4, n): truth, estimate and interval of each batch."""
    return np.array([one.compared(target) for one in judged], float).reshape(-1, 4).T


def _colour(k: int) -> int:
    """A colour of the palette, grey left out, which is for what is compared with."""
    return k % (len(COLOURS) - 1)
