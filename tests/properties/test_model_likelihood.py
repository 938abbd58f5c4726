"""The likelihood: its derivatives, and what it must not depend on."""

from dataclasses import replace

import numpy as np
import pytest
from support.model_road import BAND_HZ, GROUND, LEFT, QUIET, VAN, batch_over_road, joined, theta_of

from gateway.core.vehicle import Load
from gateway.model.car import Ground
from gateway.model.expected import log_stroke_speeds, with_strokes
from gateway.model.spectra import CrossSpectra, Reading, cross_spectra_of
from gateway.model.table import INDEX, NAMES, N
from gateway.model.whittle import Point, Whittle
from gateway.records import F64

ON_LINE = Ground.of(VAN, with_roll=True)
READING = Reading(VAN.wheelbase_m, BAND_HZ, 256)
ROLL_READING = replace(READING, with_roll=True)
LOADED = (150.0, 0.49, 0.03)
STEPS = (0.5, 1e-4, 1e-4)  # of payload in kg, front share, lateral place in m
ROLLING = theta_of(
    with_roll=True,
    gyro_lag_s=0.004,
    twist_level=1.2,
    damper_friction_rear=0.3,
    damper_digression_front=0.2,
    accelerometer_gain=0.02,
    driveline_rear_kg=20.0,
    **LEFT,
)
HALF = ROLLING[:N]


def spectra_of(reading: Reading, speeds_mps: tuple[float, ...] = (14.0,)) -> CrossSpectra:
    """Spectra of a vehicle about as far from ROLLING as a search starts."""
    theta = theta_of(with_roll=True, spring_rear_npm=95e3, **LEFT)
    batches = [
        batch_over_road(theta, Load(150.0, 49.0), 1, 0.04, 60.0, speed, shaken_mps2=0.05 * speed)
        for speed in speeds_mps
    ]
    found = cross_spectra_of([joined(*batches)], reading)
    assert found is not None
    return found


SPECTRA, ROLL_SPECTRA = spectra_of(READING), spectra_of(ROLL_READING)


def seen(which: str) -> tuple[Whittle, Point]:
    """Likelihoods of every kind, each with a point."""
    strokes = ROLL_SPECTRA.log_amplitude - np.log([[0.5, 2.0]])
    rolling, half = Point(ROLLING, *LOADED), Point(HALF, *LOADED[:2])
    moving = replace(ROLL_SPECTRA, log_strokes=strokes)
    if which == "two sensors":
        return Whittle(SPECTRA, GROUND), half
    if which == "noisier ones":
        noise = np.outer([1e-4, 1e-6], np.linspace(1.0, 3.0, SPECTRA.parts.shape[-1]))
        return Whittle(replace(SPECTRA, noise=noise), GROUND), half
    if which == "little moved":
        return Whittle(replace(SPECTRA, log_amplitude=SPECTRA.log_amplitude - 1.0), GROUND), half
    if which == "two of a car that rolls":
        return Whittle(moving.without_roll, ON_LINE, 0.5), rolling
    if which == "three sensors":
        return Whittle(moving, ON_LINE), rolling
    return Whittle(moving.within((1.1, 5.0)), ON_LINE), rolling


EVERY = pytest.mark.parametrize(
    "which",
    ["two sensors", "noisier ones", "little moved", "two of a car that rolls", "three sensors", "where the body rolls"],
)


def moved(point: Point, entry: int, by: float) -> Point:
    """The point with one entry of its parameters, or of its load, changed."""
    theta, load, n = point.theta.copy(), [point.payload_kg, point.front_share, point.cg_left_m], len(point.theta)
    if entry < n:
        theta[entry] += by
    else:
        load[entry - n] += by
    return Point(theta, *load)


@EVERY
def test_the_gradient_is_the_slope_of_the_cost(which: str) -> None:
    """By every parameter, and by the load."""
    whittle, point = seen(which)
    n = len(point.theta)
    free = range(n + len(point.loaded))
    found = whittle.curvature(point, free)
    for entry in free:
        step = 1e-4 if entry < n else STEPS[entry - n]
        up, down = (whittle.cost(moved(point, entry, by)) for by in (step, -step))
        name = NAMES[entry] if entry < n else f"load {entry - n}"
        slope = (up - down) / (2.0 * step)
        assert found.gradient[entry] == pytest.approx(slope, rel=1e-3, abs=1e-2), name


@EVERY
def test_the_information_is_the_expected_second_derivative(which: str) -> None:
    """Against spectra that are just as expected, the cost curves as Fisher says, in random directions."""
    whittle, point = seen(which)
    exact = Whittle(whittle.spectra.showing(whittle.expected(point)), whittle.ground)
    n = len(point.theta)
    free = range(n + len(point.loaded))
    found = exact.curvature(point, free)
    scale = np.maximum(np.sqrt(np.diag(found.information)), 1e-6)
    np.testing.assert_allclose(found.gradient / scale, 0.0, atol=1e-5)
    rng = np.random.default_rng(5)
    at = exact.cost(point)
    for _ in range(6):
        along = np.where(scale > 0.1, rng.standard_normal(len(scale)) / scale, 0.0)
        along *= 0.005 / np.sqrt(along @ found.information @ along)
        ends = [exact.cost(by(point, sign * along)) for sign in (1.0, -1.0)]
        assert sum(ends) - 2.0 * at == pytest.approx(along @ found.information @ along, rel=5e-3)


def by(point: Point, along: F64) -> Point:
    n = len(point.theta)
    load = np.array([point.payload_kg, point.front_share, point.cg_left_m])
    load[: len(along) - n] += along[n:]
    return Point(point.theta + along[:n], *load.tolist())


def test_some_entries_are_those_of_all() -> None:
    whittle, point = seen("three sensors")
    n = len(point.theta)
    some = [n + 1, *range(20, n, 6), 2, n, INDEX["driveline_front_kg"]]
    whole, found = whittle.curvature(point, range(n + 3)), whittle.curvature(point, some)
    scale = np.sqrt(1.0 + np.diag(whole.information))[some]  # slopes have six digits
    np.testing.assert_allclose(found.gradient / scale, whole.gradient[some] / scale, atol=1e-5)
    of_some = whole.information[np.ix_(some, some)]
    np.testing.assert_allclose(found.information / np.outer(scale, scale), of_some / np.outer(scale, scale), atol=1e-5)
    only_noise = [INDEX["noise_pitch_rate_rad2ps"]]
    assert whittle.curvature(point, only_noise).gradient == pytest.approx(whole.gradient[only_noise], rel=1e-4)


def test_a_group_s_speed_hardly_changes_what_parameters_do_to_the_driveline() -> None:
    """What the information and the gradient leave out: the costs have the groups' speeds, the slopes their mean."""
    whittle = Whittle(spectra_of(READING, (9.0, 14.0, 21.0)), GROUND)
    point = Point(HALF, *LOADED[:2])
    found = whittle.curvature(point, range(N + 2))
    slopes = np.array(
        [(whittle.cost(moved(point, i, 1e-4)) - whittle.cost(moved(point, i, -1e-4))) / 2e-4 for i in range(N)]
    )
    left_out = (slopes - found.gradient[:N]) / np.sqrt(np.diag(found.information)[:N] + 1.0)
    assert np.max(np.abs(left_out)) < 0.5
    own = [INDEX["driveline_front_kg"], INDEX["driveline_rear_kg"], INDEX["rear_lag_s"]]
    np.testing.assert_allclose(found.gradient[own], slopes[own], rtol=0.03, atol=0.1)


@EVERY
def test_points_cost_together_what_each_costs_alone(which: str) -> None:
    whittle, point = seen(which)
    points = [point, moved(point, len(point.theta), 100.0), replace(point, theta=1.01 * point.theta)]
    for some in (points, points[:2]):  # of several vehicles, and of one
        np.testing.assert_allclose(whittle.costs(some), [whittle.cost(one) for one in some], rtol=1e-12)


def test_shown_other_spectra_it_is_the_likelihood_of_those() -> None:
    whittle, point = seen("two sensors")
    whittle.cost(point)
    for other in (SPECTRA.with_pitch_reversed(), SPECTRA.with_acceleration_times(1.1)):
        fresh = Whittle(other, GROUND)
        assert whittle.showing(other).cost(point) == pytest.approx(fresh.cost(point), rel=1e-13)
        found, expected = (one.curvature(point, [2, N]) for one in (whittle.showing(other), fresh))
        np.testing.assert_allclose(found.gradient, expected.gradient, rtol=1e-9)
    assert whittle.showing(SPECTRA.with_pitch_reversed()).cost(point) > whittle.cost(point) + 100.0


@pytest.mark.parametrize("n_sensors", [2, 3])
@pytest.mark.parametrize("n", [5, 12])
def test_a_correct_model_has_the_misfit_one(n: int, n_sensors: int) -> None:
    """Means of n independent transforms, drawn from what the model expects; few scatter more than many."""
    whittle, point = seen("two sensors" if n_sensors == 2 else "three sensors")
    one = whittle.spectra
    rng = np.random.default_rng(n)
    parts = whittle.expected(point)
    matrix = np.empty((*parts.shape[1:], n_sensors, n_sensors), complex)
    for i in range(n_sensors):
        matrix[..., i, i] = parts[i]
    for pair, (i, j) in enumerate(((1, 0), (2, 0), (2, 1))[: n_sensors * (n_sensors - 1) // 2]):
        re, im = parts[n_sensors + 2 * pair], parts[n_sensors + 2 * pair + 1]
        matrix[..., i, j], matrix[..., j, i] = re + 1j * im, re - 1j * im
    root = np.linalg.cholesky(matrix)
    misfits = []
    for _ in range(20):
        x = rng.standard_normal((2, *root.shape[:-1], n)).view(float)
        x = root @ ((x[0] + 1j * x[1]) / np.sqrt(2.0))
        drawn = x @ np.conj(x.swapaxes(-1, -2)) / n
        auto = [drawn[..., i, i].real for i in range(n_sensors)]
        pairs = ((1, 0), (2, 0), (2, 1))[: n_sensors * (n_sensors - 1) // 2]
        cross = [part for i, j in pairs for part in (drawn[..., i, j].real, drawn[..., i, j].imag)]
        shown = replace(one, parts=np.array([*auto, *cross]), n_segments=np.full_like(one.n_segments, float(n)))
        misfits.append(Whittle(shown, whittle.ground).misfit(point))
    assert np.mean(misfits) == pytest.approx(1.0, abs=0.06)


def over_all(spectra: CrossSpectra, log_speeds: F64) -> F64:
    """(2,) root mean square speeds of both axles, in m/s, over all segments."""
    return np.sqrt(np.average(np.exp(2.0 * log_speeds), axis=0, weights=spectra.n_segments[:, 0]))


def test_twice_the_movement_is_twice_the_stroke() -> None:
    empty = Load(0.0, 52.0)
    slow, fast = (
        cross_spectra_of([batch_over_road(HALF, empty, 3, duration_s=60.0, shaken_mps2=by)], READING)
        for by in (0.6, 1.8)
    )
    a, b = (over_all(one, log_stroke_speeds(one, theta_of(**QUIET), empty, GROUND)) for one in (slow, fast))
    np.testing.assert_allclose(b / a, 3.0, rtol=1e-4)


def test_a_load_that_calms_the_body_makes_no_road_smooth() -> None:
    """Where the sensors show as much movement under a load, the road is rougher and the springs move faster."""
    empty, loaded = (
        over_all(SPECTRA, log_stroke_speeds(SPECTRA, HALF, load, GROUND))
        for load in (Load(0.0, 52.0), Load(400.0, 46.0))
    )
    assert np.all(loaded > 1.1 * empty)


def test_ordinary_spring_travel_reports_no_friction() -> None:
    empty = Load(0.0, 52.0)
    front_mps, rear_mps = over_all(SPECTRA, log_stroke_speeds(SPECTRA, HALF, empty, GROUND)).tolist()
    usual = replace(SPECTRA, reading=replace(SPECTRA.reading, usual_stroke_mps=(front_mps, rear_mps)))
    told = with_strokes(usual, HALF, empty, GROUND)
    np.testing.assert_allclose(over_all(told, told.log_movement), 1.0, rtol=1e-9)
    assert with_strokes(SPECTRA, HALF, empty, GROUND) is SPECTRA
    np.testing.assert_array_equal(SPECTRA.log_movement, np.repeat(SPECTRA.log_amplitude, 2, axis=1))
