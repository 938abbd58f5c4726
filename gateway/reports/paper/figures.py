"""The figures of the paper's section 4, drawn from our experiments."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gateway.calibration.judgement.evaluation import Judged
from gateway.calibration.known_run import KnownRun
from gateway.calibration.ratio_index.least_squares import fit_regression
from gateway.calibration.ratio_index.spectra_table import N_SEGMENT, IndexRows, index_rows
from gateway.core.ratio_index.index import PAPER_BANDS, band_pass_gain, mean_spectrum
from gateway.core.ratio_index.regression import MODEL_9_PAYLOAD, MODEL_10_FRONT_SHARE
from gateway.records import F64
from gateway.reports.charts.still import panels
from gateway.reports.paper.experiments import Experiments, Method
from gateway.units import NS_PER_S

COLOURS = ("#0b6fa4", "#d1495b", "#2e8b57", "#8e6c8a", "#edae49")
ACCELERATION = "acceleration"
PITCH_RATE = "pitch_rate"
UNIT = {ACCELERATION: "m/s²/√Hz", PITCH_RATE: "rad/s/√Hz"}
NAME = {ACCELERATION: "vertical acceleration", PITCH_RATE: "pitch rate"}
LOAD, SHARE = "payload [kg]", "front share [%]"


def spectrum_of(run: KnownRun, sensor: str) -> tuple[F64, F64]:
    """Mean amplitude spectrum over a run's batches: frequencies (m,) and amplitudes (m,), NaN if no batch is usable."""
    freq_hz, total, n = np.arange(1.0, 205.0) * (50.0 / N_SEGMENT), np.zeros(204), 0
    for batch in run.batches:
        x = batch.vertical_acceleration_mps2 if sensor == ACCELERATION else batch.pitch_rate_radps
        spectrum = mean_spectrum(x, batch.usable, N_SEGMENT, batch.rate_hz, "amplitude")
        if spectrum is not None:
            freq_hz, total, n = spectrum[0], total + spectrum[1], n + 1
    return freq_hz, total / n if n else np.full(len(freq_hz), np.nan)


def figure_1(experiments: Experiments) -> Figure:
    """Spectra of acceleration for several loads, and of pitch rate for several shares."""
    figure, (left, right) = panels(1, 2)
    for run in experiments.driven["load-sweep"].runs[::3]:
        left.plot(*spectrum_of(run, ACCELERATION), label=f"{run.payload_kg:.0f} kg", linewidth=1.0)
    for run in experiments.driven["share-sweep"].runs[::4]:
        right.plot(*spectrum_of(run, PITCH_RATE), label=f"{run.front_share_pct:.0f} %", linewidth=1.0)
    for axes, sensor in ((left, ACCELERATION), (right, PITCH_RATE)):
        _label(axes, "frequency [Hz]", f"{NAME[sensor]} [{UNIT[sensor]}]")
    return figure


def band_differences(experiments: Experiments, sensor: str, width_hz: float) -> tuple[F64, F64]:
    """(4) or (5): frequencies (m,) and J (m,) between the extremes of the sensor's sweep."""
    runs = experiments.driven["load-sweep" if sensor == ACCELERATION else "share-sweep"].runs
    (freq_hz, low), (_, high) = spectrum_of(runs[0], sensor), spectrum_of(runs[-1], sensor)
    n = max(round(width_hz / (freq_hz[1] - freq_hz[0])), 1)
    return freq_hz, np.convolve(high - low, np.full(n, 1.0 / n), mode="same")


def figure_bands(experiments: Experiments) -> Figure:
    """J_L and J_D over frequency, with the bands of our calibration and of the paper."""
    figure, axes_of = panels(1, 2)
    own = experiments.ratio_index
    chosen = {ACCELERATION: own.acceleration_bands, PITCH_RATE: own.pitch_rate_bands}
    for axes, sensor, name in zip(axes_of, (ACCELERATION, PITCH_RATE), ("J_L", "J_D"), strict=True):
        for width_hz, colour in ((0.05, "#bbbbbb"), (0.5, COLOURS[0])):
            axes.plot(
                *band_differences(experiments, sensor, width_hz), color=colour, label=f"{name}, w = {width_hz:g} Hz"
            )
        for bands, colour, label in ((chosen[sensor], COLOURS[2], "ours"), (PAPER_BANDS[sensor], COLOURS[1], "paper")):
            for band, (style, part) in zip(bands, (("-", "over"), ("--", "under")), strict=True) if bands else ():
                axes.axvline(band.centre_hz, color=colour, linestyle=style, linewidth=1.0, label=f"{label}, {part}")
        axes.axhline(0.0, color="black", linewidth=0.6)
        _label(axes, "frequency [Hz]", f"{name} [{UNIT[sensor]}]")
    return figure


def figure_2(experiments: Experiments) -> Figure:
    """Signals empty and full, unfiltered and through the two band-passes (6)."""
    figure, axes_of = panels(1, 2)
    runs = experiments.driven["load-sweep"].runs
    bands = experiments.ratio_index.acceleration_bands or PAPER_BANDS[ACCELERATION]
    for axes, run in zip(axes_of, (runs[0], runs[-1]), strict=True):
        freq_hz, spectrum = spectrum_of(run, ACCELERATION)
        axes.plot(freq_hz, spectrum, color="#999999", label=f"{run.payload_kg:.0f} kg")
        for band, colour in zip(bands, COLOURS[:2], strict=True):
            name = f"{band.centre_hz:g} Hz, w = {band.width_hz:g} Hz"
            axes.plot(freq_hz, band_pass_gain(freq_hz, band) * spectrum, color=colour, label=name)
        _label(axes, "frequency [Hz]", f"{NAME[ACCELERATION]} [{UNIT[ACCELERATION]}]")
    return figure


def figure_3_4(experiments: Experiments) -> Figure:
    """R_a against the load alone with (9), R_g against the share alone with (10)."""
    figure, (left, right) = panels(1, 2)
    rows = index_rows(experiments.driven["load-sweep"].runs, experiments.ratio_index)
    _index_and_fit(left, rows, rows.ra, rows.payload_kg, MODEL_9_PAYLOAD)
    _label(left, "R_a", LOAD)
    rows = index_rows(experiments.driven["share-sweep"].runs, experiments.ratio_index)
    _index_and_fit(right, rows, rows.rg, rows.front_share_pct, MODEL_10_FRONT_SHARE)
    _label(right, "R_g", SHARE)
    return figure


def _index_and_fit(axes: Axes, rows: IndexRows, index: F64, target: F64, terms: tuple[str, ...]) -> None:
    axes.plot(index, target, "o", color=COLOURS[0], label="batches")
    model = fit_regression(terms, rows.ra, rows.rg, target, rows.run).model
    along = np.linspace(np.min(index), np.max(index), 60)
    fitted = [model.predict(x, x)[0] for x in along]
    axes.plot(along, fitted, color=COLOURS[1], label=f"{' + '.join(terms)}, residual {model.residual_std:.2g}")


def figure_5_6(experiments: Experiments) -> Figure:
    """The explored conditions and both indexes over them."""
    figure, (left, middle, right) = panels(1, 3)
    rows = index_rows(experiments.driven["ident"].runs, experiments.ratio_index)
    left.plot(rows.payload_kg, rows.front_share_pct, "o", color=COLOURS[0])
    _label(left, LOAD, SHARE)
    by_share = middle.scatter(rows.payload_kg, rows.ra, c=rows.front_share_pct, s=14, cmap="viridis")
    _label(middle, LOAD, "R_a")
    figure.colorbar(by_share, ax=middle, label=SHARE)
    by_load = right.scatter(rows.front_share_pct, rows.rg, c=rows.payload_kg, s=14, cmap="plasma")
    _label(right, SHARE, "R_g")
    figure.colorbar(by_load, ax=right, label=LOAD)
    return figure


def figure_7(experiments: Experiments) -> Figure:
    """The joint model (11) and the other estimators on the grid they were calibrated on."""
    runs = experiments.driven["ident"].runs
    return _estimated_over_true([(method.label, method.judge(runs), "o") for method in experiments.simulated])


def figure_8_9(experiments: Experiments) -> Figure:
    """Spectra for two roughnesses; the road's low-pass (1) at several speeds, with and without the wheelbase filter."""
    figure, (left, right) = panels(1, 2)
    for iri in ("iri2", "iri8"):
        run = next(run for run in experiments.driven["sensitivity"].runs if iri in run.name)
        left.plot(*spectrum_of(run, ACCELERATION), label=f"IRI {iri[3:]}", linewidth=1.0)
    _label(left, "frequency [Hz]", f"{NAME[ACCELERATION]} [{UNIT[ACCELERATION]}]")
    freq_hz = np.linspace(0.05, 10.0, 800)
    wheelbase_m = experiments.driven["ident"].campaign.vehicle.wheelbase_m
    for kmh, colour in zip((30.0, 50.0, 90.0), COLOURS[:3], strict=True):
        speed_mps = kmh / 3.6
        road = 1.0 / np.abs(2j * np.pi * freq_hz + 0.15 * speed_mps)
        both_axles = road * np.abs(np.cos(np.pi * freq_hz * wheelbase_m / speed_mps))
        right.semilogy(freq_hz, road, color=colour, linestyle="--", linewidth=0.8)
        right.semilogy(freq_hz, both_axles, color=colour, linewidth=1.2, label=f"{kmh:.0f} km/h")
    right.set_ylim(1e-4, 1.0)
    _label(right, "frequency [Hz]", "road into heave: paper dashed, with the wheelbase solid")
    return figure


def figure_sensitivity(experiments: Experiments) -> Figure:
    """Each method's estimates of one load at other speeds and roads, with the ratio index's gate disabled."""
    figure, (top, bottom) = panels(2, 1, height_in=2.6)
    runs = experiments.driven["sensitivity"].runs
    places = np.arange(len(runs))
    for n, method in enumerate(experiments.simulated):
        colour = COLOURS[n]
        errors = np.array([mean_errors(run, method) for run in runs])
        for axes, column in ((top, 0), (bottom, 1)):
            axes.plot(places, errors[:, column], "o-", color=colour, label=method.label, linewidth=0.7)
    for axes, name in ((top, "payload error [kg]"), (bottom, "share error [points]")):
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set_xticks(places, [condition_of(run) for run in runs], rotation=25, ha="right")
        _label(axes, "", name)
    return figure


def condition_of(run: KnownRun) -> str:
    """ "08_L225_D50.0_50kmh_iri2/can.log.gz" -> "50kmh iri2"."""
    return " ".join(run.name.split("/", maxsplit=1)[0].split("_")[3:])


def mean_errors(run: KnownRun, method: Method) -> tuple[float, float]:
    """Mean error of payload [kg] and share [points] over a run's batches, with the ratio index's gates disabled."""
    if method.estimator == "ratio_index" and method.calibrated.ratio_index is not None:
        calibration = method.calibrated.ratio_index
        rows = index_rows([run], calibration)
        models = (calibration.payload, calibration.front_share)
        estimated = [
            [m.predict(a, g)[0] if m else np.nan for m in models] for a, g in zip(rows.ra, rows.rg, strict=True)
        ]
        errors = np.array(estimated).reshape(-1, 2) - np.column_stack([rows.payload_kg, rows.front_share_pct])
    else:
        errors = np.array(
            [
                (one.estimate.payload.number - one.payload_kg, one.estimate.front_share.number - one.front_share_pct)
                for one in method.judge([run])
                if one.estimate.counted
            ]
        ).reshape(-1, 2)
    return (float(np.mean(errors[:, 0])), float(np.mean(errors[:, 1]))) if len(errors) else (np.nan, np.nan)


def figure_test(experiments: Experiments, kind: str) -> Figure:
    """Payload and share over time: the truth as a line, and each method's batches with 95 % intervals."""
    figure, axes_of = panels(2, 1, height_in=2.4)
    runs = experiments.driven[kind].runs
    start_ns = runs[0].batches[0].t_start_ns
    for n, method in enumerate(experiments.simulated):
        told = [one.estimate for one in method.judge(runs) if one.estimate.counted]
        middle_min = [np.mean(_minutes(e.t_start_ns, e.t_end_ns, start_ns)) for e in told]
        for axes, quantities in zip(axes_of, ([e.payload for e in told], [e.front_share for e in told]), strict=True):
            centre = np.array([one.number for one in quantities])
            reach = np.abs(np.array([one.interval95 for one in quantities]).reshape(-1, 2) - centre[:, None]).T
            axes.errorbar(middle_min, centre, yerr=reach, fmt="o", color=COLOURS[n], label=method.label,
                          markersize=3.5, linewidth=0.8)  # fmt: skip
    _with_truth(axes_of, runs, start_ns)
    return figure


def figure_drive(experiments: Experiments, kind: str, method: Method) -> Figure:
    """One method's estimates over a drive with changing loads: its 95 % band and the truth."""
    figure, axes_of = panels(2, 1, height_in=2.2)
    runs = experiments.driven[kind].runs
    start_ns = runs[0].batches[0].t_start_ns
    told = [one.estimate for one in method.judge(runs) if one.estimate.counted]
    for k, e in enumerate(told):
        when = _minutes(e.t_start_ns, e.t_end_ns, start_ns)
        for axes, quantity in zip(axes_of, (e.payload, e.front_share), strict=True):
            label = "" if k else "estimate, 95 % interval"
            axes.fill_between(when, *quantity.interval95, color=COLOURS[0], alpha=0.25, linewidth=0.0, label=label)
            axes.plot(when, [quantity.number] * 2, color=COLOURS[0], linewidth=1.5)
    _with_truth(axes_of, runs, start_ns, "truth")
    return figure


def _minutes(begin_ns: int, end_ns: int, start_ns: int) -> list[float]:
    return [(t - start_ns) / NS_PER_S / 60.0 for t in (begin_ns, end_ns)]


def _with_truth(axes_of: Sequence[Axes], runs: Sequence[KnownRun], start_ns: int, label: str = "") -> None:
    top, bottom = axes_of
    for n, run in enumerate(runs):
        when = _minutes(run.batches[0].t_start_ns, run.batches[-1].t_end_ns, start_ns)
        for axes, truth in ((top, run.payload_kg), (bottom, run.front_share_pct)):
            axes.plot(when, [truth] * 2, color="black", linewidth=2.0, label="" if n else label)
    _label(top, "", LOAD)
    _label(bottom, "time [min]", SHARE)


def figure_13(experiments: Experiments) -> Figure:
    figure, (axes,) = panels(1, 1)
    runs = experiments.driven["experiment"].identification
    axes.plot([run.payload_kg for run in runs], [run.front_share_pct for run in runs], "s", color=COLOURS[0])
    _label(axes, LOAD, SHARE)
    return figure


def figure_14(experiments: Experiments) -> Figure:
    """The experiment: estimates over truth; identification with hollow, validation with filled markers."""
    experiment = experiments.driven["experiment"]
    series = []
    for method in experiments.experimental:
        series.append((f"{method.label}, identification", method.judge(experiment.identification), "o"))
        series.append((f"{method.label}, validation", method.judge(experiment.validation), "s"))
    return _estimated_over_true(series)


def _estimated_over_true(series: Sequence[tuple[str, list[Judged], str]]) -> Figure:
    figure, (left, right) = panels(1, 2, height_in=3.6)
    for n, (label, judged, marker) in enumerate(series):
        counted = [one for one in judged if one.estimate.counted]
        pairs = (
            (left, [(one.payload_kg, one.estimate.payload.number) for one in counted]),
            (right, [(one.front_share_pct, one.estimate.front_share.number) for one in counted]),
        )
        for axes, points in pairs:
            axes.plot(*np.array(points).reshape(-1, 2).T, marker, color=COLOURS[n % len(COLOURS)],
                      markersize=4, alpha=0.7, label=label)  # fmt: skip
    for axes, name in ((left, LOAD), (right, SHARE)):
        ends = axes.get_xlim()
        axes.plot(ends, ends, color="black", linewidth=0.6)
        _label(axes, f"true {name}", f"estimated {name}")
    return figure


def _label(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=7)
