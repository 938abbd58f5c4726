"""From drives and statements to a vehicle's posterior: one hierarchical fit.

    teach(drives, vehicle) -> Taught          the vehicle, every drive's load, and what each statement was worth

A drive is driven by a vehicle that nearly is the one that is sought; by how much it deviates is in the table. Its load
is what somebody stated of it, with that doubt, or unknown; errors that statements have in common are found too
(gateway.calibration.statements). Heave and pitch are fitted to what the sensors would measure on the centre line, roll
to all three sensors with the half-car as found; they take turns (docs/architecture.md). Drives left out, weighed as the
service weighs, show the model's error.
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from itertools import combinations
from math import isfinite, log
from typing import Final

import numpy as np

from gateway.calibration.fit_of_drives import (
    STARTS,
    WEAK_DISAGREEMENT,
    FitOfDrives,
    directions_of,
    fit_drives,
    weighed_left_out,
)
from gateway.calibration.found import ClaimState, FoundClaim, Taught
from gateway.calibration.left_out import LeftOut, ModelErrors, model_errors_shown_by
from gateway.calibration.prior import Prior
from gateway.calibration.read_drive import BAND_HZ, N_SEGMENT, ReadDrive, can_roll
from gateway.calibration.stated_drive import StatedDrive
from gateway.calibration.statements import common_causes
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.model.spectra import Reading, Segments, grouped, segments_of
from gateway.model.vehicle_model import VehicleModel

MOST_DISAGREEMENT: Final = 3.7  # chosen: standard deviations; chance exceeds it for one statement in five thousand
MOST_SUSPECTS: Final = 4  # chosen: statements compared before one is held
MOST_PAIRS: Final = 2  # chosen: statements that may have been exchanged; each pair costs a rough fit
EXCHANGED: Final = 0.01  # chosen: probability that a statement was exchanged with another; with each of them alike
LEAST_WITNESSES: Final = 3  # chosen: two drives must remain for a scale
UNTESTED: Final = "intervals_untested"

Progress = Callable[[int, int], None]
"""Called with the steps done and the steps in all."""


def teach(
    drives: Sequence[StatedDrive],
    vehicle: Vehicle,
    sister: VehicleModel | None = None,
    progress: Progress | None = None,
) -> Taught:
    """The vehicle that these drives teach. ``sister`` is a vehicle of the same model, as it was taught.

    A statement that disagrees beyond chance with its own drive, as the others see it, is held: it teaches nothing.
    Raises CalibrationImpossibleError if no drive has enough steady driving.
    """
    known = _drives(drives, vehicle, sister)
    prior = _prior(known, vehicle, sister)
    witnesses = [one for one in known if one.drive.statement.is_of_payload]
    n_steps = (1 if sister else len(STARTS)) + 1 + (len(witnesses) if len(witnesses) >= LEAST_WITNESSES else 0)
    done = iter(range(1, n_steps + 1))

    def step() -> None:
        if progress is not None:
            progress(next(done, n_steps), n_steps)

    fitted, claims = _tested(known, prior, step)
    loads = [fitted.found_load(i, claims) for i in range(len(known))]
    step()
    model = fitted.model(vehicle)
    if not isfinite(model.misfit_limit):
        raise CalibrationImpossibleError(
            "hardly two stretches were driven at one speed, so the fit of the half-car cannot be tested: drive at an "
            "even speed"
        )
    model = replace(model, directions=directions_of(model, vehicle, fitted))
    without: dict[str, VehicleModel] = {}
    errors: list[LeftOut] = []
    witnesses = [one for one in fitted.seen if one.drive.statement.is_of_payload]
    if len(witnesses) >= LEAST_WITNESSES:
        for one in witnesses:
            left, *causes = fitted.without(one, vehicle)
            without[one.drive.name] = replace(left, directions=model.directions)
            errors += weighed_left_out(one, without[one.drive.name], one.terms.truth(*causes))
            step()
    model_errors = model_errors_shown_by(errors, model.misfit_limit, vehicle.empty_mass_kg)
    if not errors:
        model_errors = model_errors if sister is None else ModelErrors.of(sister)
        model = model.with_warning(UNTESTED)
    return Taught(
        model_errors.on(model),
        tuple(loads),
        {name: model_errors.on(one) for name, one in without.items()},
        tuple(errors),
        tuple(claims),
        fitted.found_causes,
    )


def examined(drives: Sequence[StatedDrive], vehicle: Vehicle, sister: VehicleModel | None) -> tuple[FoundClaim, ...]:
    """The statements about these drives, tested as :func:`teach` does; none if no drive has enough steady driving."""
    try:
        known = _drives(drives, vehicle, sister)
    except CalibrationImpossibleError:
        return ()
    return tuple(_tested(known, _prior(known, vehicle, sister), lambda: None)[1])


def _prior(known: Sequence[ReadDrive], vehicle: Vehicle, sister: VehicleModel | None) -> Prior:
    with_roll = known[0].spectra.has_roll
    if sister is None:
        return Prior.of_any(vehicle, with_roll=with_roll)
    return Prior.of_sister(sister, vehicle, with_roll=with_roll)


def _tested(
    known: Sequence[ReadDrive], prior: Prior, step: Callable[[], None]
) -> tuple["FitOfDrives", list[FoundClaim]]:
    """The fit of all drives, and its statements tested.

    Known loads count as driven in one box on one day. If that makes them contradict each other, the drives may rather
    have been of several days: what is more probable counts.
    """
    fitted, found = _judged(known, prior, step, is_one_day=True)
    if any(one.state is ClaimState.HELD for one in found) and any(one.stated.is_compact for one in known):
        other, found_otherwise = _judged(known, prior, step, is_one_day=False)
        if other.log_evidence(found_otherwise) > fitted.log_evidence(found):
            return other, found_otherwise
    return fitted, found


def _judged(
    known: Sequence[ReadDrive], prior: Prior, step: Callable[[], None], *, is_one_day: bool
) -> tuple["FitOfDrives", list[FoundClaim]]:
    """The fit of all drives, of whose statements each is believed, counts less, or is held.

    A wrong statement makes others look wrong, sometimes more than itself: of those that look wrong the one is held
    first without which all drives are explained best. One that agrees once others are held is believed again. If the
    loads of two drives were exchanged, both are held, although one of the drives alone may not be sure enough.
    """
    causes = common_causes(claim for one in known for claim in one.claims)
    confirmed = {claim.name for one in known for claim in one.claims if claim.is_confirmed}
    held: set[str] = set()
    pardoned: set[str] = set()
    exchanged: dict[str, str] = {}
    tried: set[frozenset[str]] = set()
    softened: dict[str, float] = {}
    fitted: FitOfDrives | None = None
    while True:
        drives = [one.believing(held, softened, causes, is_one_day=is_one_day) for one in known]
        fitted = fit_drives(drives, causes, prior, step, fitted)
        found = [claim for i, one in enumerate(known) for claim in fitted.found_claims(i, one, held, softened)]
        off = {one.name: one.disagreement for one in found if one.name not in held | confirmed}
        if suspects := sorted((name for name in off if off[name] > MOST_DISAGREEMENT), key=lambda name: -off[name]):
            held.add(fitted.least_likely(suspects[:MOST_SUSPECTS]))
            continue
        as_stated = [one.believing((), {}, causes, is_one_day=is_one_day) for one in known] if held else []
        others = [one for one in found if one.name not in exchanged and one.name not in confirmed]
        if (pair := _exchanged(as_stated, fitted, found, others, tried)) is not None:
            exchanged |= {pair[0].name: pair[1].drive, pair[1].name: pair[0].drive}
            held |= {one.name for one in pair}
            continue
        agreeing = {one.name for one in found if one.disagreement < WEAK_DISAGREEMENT} & held - pardoned - {*exchanged}
        weak = {name: z / WEAK_DISAGREEMENT for name, z in off.items() if z > WEAK_DISAGREEMENT}
        weak = {name: factor for name, factor in weak.items() if name not in softened}
        if not (agreeing or weak):
            return fitted, [replace(one, exchanged_with=exchanged.get(one.name)) for one in found]
        pardoned |= agreeing
        held -= agreeing
        softened |= weak


def _exchanged(
    known: Sequence[ReadDrive],
    fitted: "FitOfDrives",
    found: Sequence[FoundClaim],
    others: Sequence[FoundClaim],
    tried: set[frozenset[str]],
) -> tuple[FoundClaim, FoundClaim] | None:
    """Two of the ``others``, at least one of them held, that explain all drives better once they exchange their drives:
    so much better as it is unlikely that just these two were exchanged.

    Those that promise most are tried, by what either drive says and by its likelihood with the other's load; ``tried``
    keeps which.
    """
    places = {one.drive.name: i for i, one in enumerate(known)}
    alone = [one for one in others if sum(other.drive == one.drive or other.name == one.name for other in found) == 1]
    pairs = [
        pair
        for pair in combinations(alone, 2)
        if any(one.state is ClaimState.HELD for one in pair) and frozenset(one.name for one in pair) not in tried
    ]
    gains = {pair: fitted.gain_of_exchange(known, *(places[one.drive] for one in pair)) for pair in pairs}
    likely = [pair for pair in sorted(pairs, key=lambda pair: -gains[pair])[:MOST_PAIRS] if gains[pair] > 0.0]
    near = [pair for pair in pairs if pair[0].distance(pair[1]) < MOST_DISAGREEMENT and pair not in likely]
    best = fitted.log_evidence(found) - log(EXCHANGED / max(1, len(alone) - 1))
    for pair in (*likely, *sorted(near, key=lambda pair: pair[0].distance(pair[1]))[:MOST_PAIRS]):
        tried.add(frozenset(one.name for one in pair))
        drives = list(fitted.seen)
        for one, other in (pair, reversed(pair)):
            i, said = places[one.drive], known[places[other.drive]].drive.statement
            exchanged = copy(fitted.seen[i])
            exchanged.drive = replace(known[i].drive, statement=said)
            drives[i] = exchanged.believing((), {}, fitted.causes)
        if fitted.again(drives).log_evidence([one for one in found if one not in pair]) > best:
            return pair
    return None


def _drives(drives: Sequence[StatedDrive], vehicle: Vehicle, sister: VehicleModel | None) -> list[ReadDrive]:
    """The drives with enough steady driving, all read alike: the roll rate only if every one has it."""
    reading = Reading(vehicle.wheelbase_m, BAND_HZ, N_SEGMENT, with_roll=can_roll(vehicle))

    def read(reading: Reading) -> list[tuple[StatedDrive, Segments]]:
        each = ((one, segments_of([b for b in one.batches if not b.rejected], reading)) for one in drives)
        return [(one, segments) for one, segments in each if segments is not None]

    found = read(reading)
    if not found:
        raise CalibrationImpossibleError(
            "no run has enough steady driving with both sensors for the cross-spectral estimator: drive at least a "
            "minute at speed, and map both"
        )
    if reading.with_roll and any(len(segments.sensed) < 3 for _, segments in found):
        reading = replace(reading, with_roll=False)
        found = read(reading)
    usual = sister.usual_log_amplitude if sister else None
    if usual is None:
        each = [grouped(segments, reading).reading.usual_log_amplitude for _, segments in found]
        usual = float(np.median(np.array(each, float)))
    reading = replace(reading, usual_log_amplitude=usual)
    return [ReadDrive(one, vehicle, segments, reading) for one, segments in found]
