"""One hierarchical fit of a vehicle and its drives: half-car and roll in turns, and what follows from the posterior."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import exp, log, nan, pi, sqrt
from statistics import fmean
from typing import Final

import numpy as np

from gateway.calibration.found import ClaimState, FoundClaim, FoundLoad
from gateway.calibration.left_out import USUAL_FRONT_SHARE_PCT, USUAL_PAYLOAD_SHARE, LeftOut, ModelErrors, most_misfit
from gateway.calibration.prior import MODE, Prior, own_prior
from gateway.calibration.read_drive import EVIDENCE, OfVehicle, ReadDrive, RollingDrive
from gateway.calibration.statements import LEAST_PRECISION, Statement, Terms, load_prior_of, shared_disagreement
from gateway.core.bends import joined_gains
from gateway.core.cargo import known_shape, shape_hypotheses
from gateway.core.vehicle import Load, Vehicle
from gateway.model import fit
from gateway.model.answer import answers_by_vehicle
from gateway.model.car import Ground
from gateway.model.checks import MOST_TENSION, reach_of
from gateway.model.hypotheses import SOFT_HZ
from gateway.model.mixture import mixture_of
from gateway.model.place import spectra_of_sides
from gateway.model.spectra import CrossSpectra, usual_floor
from gateway.model.table import INDEX, N_OWN, NAMES, OWN, N
from gateway.model.vehicle_model import VehicleModel
from gateway.model.weigh import weigh
from gateway.model.whittle import Point, Whittle
from gateway.records import F64, Why

LEAST_MOMENT_STD_KGM: Final = 0.5  # chosen: about the centre line, also of an empty vehicle with its loose items
TURNS: Final = 3  # chosen: the second finds the sensor's place, the third the stroke speeds and so friction
STARTS: Final = ((0.0, 0.0), (0.4, 0.3), (-0.4, -0.3))  # log springs, log dampers, off the prior's middle
ROUGH, FINE = 1.0, 0.05  # chosen: tolerances in log posterior, of a start and of the result
RESEEDS: Final = 3  # chosen: attempts to lift drives out of false peaks
RESEED_GAIN: Final = 2.0  # chosen: in log posterior, of a peak that is worth moving to
SEEDS: Final = (8, (0.25, 0.5, 0.75, 1.0))  # chosen: payloads, and places in wheelbases, of a drive's starting loads
GROSS_ERRORS: Final = 0.05  # chosen: probability that a statement is of another load
WEAK_DISAGREEMENT: Final = 2.5  # chosen: from here on a statement counts less, as in Huber's estimate of a mean
MOST_DIRECTIONS: Final = 8  # chosen: they carry 98 % and more of the payload's variance
SCALES: Final = np.array([10.0, 0.2, 0.005])  # chosen: kg, %, m of equal weight
SPRINGS_FROM_PRIORS: Final = "springs_from_priors"


@dataclass(frozen=True, eq=False)
class FitOfDrives:
    """The result of one fit: the half-car with its drives, and roll."""

    seen: list[ReadDrive]
    causes: tuple[str, ...]
    half_car: fit.Found
    rolling: fit.Found | None
    prior: Prior
    usual_mps: tuple[float, float] | None

    @property
    def upright(self) -> F64:
        """(N,) the half-car's parameters."""
        return self.half_car.common[:N]

    @property
    def theta(self) -> F64:
        """(n,) its parameters."""
        roll = np.empty(0) if self.rolling is None else self.rolling.common
        theta: F64 = np.r_[self.upright, roll]
        return theta

    @property
    def found_causes(self) -> dict[str, tuple[float, float]]:
        """Mean and standard deviation of each error that claims have in common."""
        stds = np.sqrt(np.diag(self.half_car.covariance)[N:]).tolist()
        return dict(zip(self.causes, zip(self.half_car.common[N:].tolist(), stds, strict=True), strict=True))

    def _joint(self, i: int) -> tuple[F64, F64]:
        """Mean and covariance (1 + m) of drive i's payload and the common causes."""
        found = self.half_car
        m = len(self.causes)
        covariance = np.empty((1 + m, 1 + m))
        covariance[0, 0] = found.own_covariances[i][N_OWN, N_OWN]
        covariance[0, 1:] = covariance[1:, 0] = found.across[i][N:, N_OWN]
        covariance[1:, 1:] = found.covariance[N:, N:]
        return np.r_[found.own[i][N_OWN], found.common[N:]], covariance

    def found_load(self, i: int, claims: Sequence[FoundClaim]) -> FoundLoad:
        """Of drive i."""
        own, covariance = self.half_car.own[i], self.half_car.own_covariances[i]
        across = self.half_car.across[i][:, N_OWN]
        by_vehicle = across @ np.linalg.solve(self.half_car.covariance, across)
        one = self.seen[i]
        without_kg = without_std_kg = stated_kg = stated_std_kg = nan
        if one.terms.names:
            mean, left = one.terms.without(*self._joint(i), range(len(one.terms.names)))
            without_kg, without_std_kg = float(mean[0]), float(left[0, 0]) ** 0.5
            stated_kg, stated_std_kg = one.terms.truth(self.half_car.common[N:], self.half_car.covariance[N:, N:])
        name = one.drive.name
        return FoundLoad(
            name=name,
            load=load_of(own),
            deviations=own[:N_OWN],
            payload_std_kg=float(covariance[N_OWN, N_OWN]) ** 0.5,
            without_kg=without_kg,
            without_std_kg=without_std_kg,
            is_held=any(claim.drive == name and claim.state is ClaimState.HELD for claim in claims),
            own_std_kg=max(float(covariance[N_OWN, N_OWN]) - float(by_vehicle), 0.0) ** 0.5,
            stated_kg=stated_kg,
            stated_std_kg=stated_std_kg,
        )

    def found_claims(
        self, i: int, stated: ReadDrive, held: Collection[str], softened: Mapping[str, float]
    ) -> Iterator[FoundClaim]:
        """Every statement about drive i as it was ``stated``, tested: also what is held."""
        terms, (mean, covariance) = self.seen[i].terms, self._joint(i)
        model_kg, model_share = self._model_error(i)
        for claim in stated.claims:
            whole = Terms.of([claim], self.causes)
            error_kg = float(np.hypot(whole.own_kg[0], model_kg))
            if claim.name in terms.names:
                at = terms.names.index(claim.name)
                by_others, left = terms.without(mean, covariance, [at])
                off = terms.disagreement(at, mean, covariance, error_kg)
            else:
                by_others, left = mean, covariance
                row = np.r_[1.0, -whole.shared_kg[0]]
                off = float(abs(row @ mean - claim.payload_kg) / np.sqrt(row @ covariance @ row + error_kg**2))
            causes = self.found_causes
            for cause, _ in claim.shared:
                if cause == claim.name and cause in causes:
                    off = max(off, shared_disagreement(causes[cause][0], causes[cause][1] ** 2))
            by_place = self._place_disagreement(i, stated, model_share) if claim.name == stated.placed_by else 0.0
            state = ClaimState.WEAK if claim.name in softened else ClaimState.USED
            yield FoundClaim(
                name=claim.name,
                drive=stated.drive.name,
                state=ClaimState.HELD if claim.name in held else state,
                disagreement=max(off, by_place),
                said_kg=claim.payload_kg,
                said_std_kg=claim.std_kg,
                without_kg=float(by_others[0]),
                without_std_kg=float(left[0, 0]) ** 0.5,
                is_of_place=by_place > max(off, WEAK_DISAGREEMENT),
            )

    def log_evidence(self, claims: Sequence[FoundClaim]) -> float:
        """Logarithm of the probability of drives and statements, up to a constant, by Laplace's approximation.

        A statement that is held is a gross error: any payload that the vehicle may carry, with a small probability.
        """
        own = [one.own_prior.precision[np.ix_(free, free)] for one in self.seen
               if (free := np.flatnonzero(np.diag(one.own_prior.precision)).tolist())]  # fmt: skip
        volume = 0.5 * sum(float(np.linalg.slogdet(precision)[1]) for precision in own) - self.half_car.log_volume
        words = -sum(float(np.sum(np.log(one.terms.own_kg * sqrt(2.0 * pi)))) for one in self.seen)
        most_kg = self.seen[0].vehicle.largest_payload_kg
        n_held = sum(claim.state is ClaimState.HELD for claim in claims)
        return volume + words - self.half_car.cost + n_held * log(GROSS_ERRORS / most_kg)

    def least_likely(self, names: Sequence[str]) -> str:
        """Of these statements the one without which all drives are explained best."""
        if len(names) == 1:
            return names[0]
        costs = {
            name: self.again([one.believing({name}, {}, self.causes) for one in self.seen]).half_car.cost
            for name in names
        }
        return min(names, key=lambda name: costs[name])

    def gain_of_exchange(self, stated: Sequence[ReadDrive], i: int, j: int) -> float:
        """In log likelihood, if each of two drives carried what is stated of the other, all else as it is."""
        gain = 0.0
        for one, other in ((i, j), (j, i)):
            own, said = self.half_car.own[one].copy(), stated[other].stated
            here = self.seen[one].point(self.half_car.common, own)
            own[N_OWN:] = said.payload_kg, said.front_share
            there = self.seen[one].point(self.half_car.common, own)
            own[N_OWN:] = stated[one].stated.payload_kg, stated[one].stated.front_share
            as_stated = self.seen[one].point(self.half_car.common, own)
            costs = self.seen[one].whittle.costs([there, as_stated, here])
            gain += float(costs[1] - costs[0])
        return gain

    def again(self, drives: list[ReadDrive]) -> "FitOfDrives":
        """A rough fit of the same drives with other statements, from here and from a usual vehicle; roll stays."""
        upright = self.prior.upright(len(self.causes))
        usual = [one.own_prior.mean for one in drives]
        starts = ((self.half_car.common, self.half_car.own), (upright.mean, usual))
        tried = [
            _lifted(drives, upright, fit.most_probable(common, upright, _at(drives, own), ROUGH))
            for common, own in starts
        ]
        return replace(self, seen=drives, half_car=min(tried, key=lambda found: found.cost))

    def _model_error(self, i: int) -> tuple[float, float]:
        """Standard deviations of payload (kg) and front share (0..1) of drive i that the model's own error causes, and
        without a roll rate the load's unknown place across (gateway.model.answer says how).
        """
        one, own = self.seen[i], self.half_car.own[i]
        usual = USUAL_PAYLOAD_SHARE * one.vehicle.empty_mass_kg, USUAL_FRONT_SHARE_PCT / 100.0
        point = one.point(self.half_car.common, own)
        sides = spectra_of_sides(one.whittle, point, self._plain) if self.rolling is None else ()
        if not sides:
            return usual
        across = self.half_car.across[i]
        by_vehicle = across.T @ np.linalg.solve(self.half_car.covariance, across)
        information = np.linalg.inv(self.half_car.own_covariances[i] - by_vehicle)
        information[N_OWN, N_OWN] -= np.sum(one.terms.own_kg**-2.0)
        if one.drive.statement.has_place:
            information[N_OWN + 1, N_OWN + 1] -= one.own_prior.precision[N_OWN + 1, N_OWN + 1]
        values, vectors = np.linalg.eigh(information)
        free = (vectors / np.maximum(values, LEAST_PRECISION)) @ vectors.T
        n = len(point.theta)

        def moved(parts: F64) -> F64:
            shown = one.whittle.showing(one.whittle.spectra.showing(parts))
            return np.asarray(-free @ shown.curvature(point, [*OWN, n, n + 1]).gradient)[N_OWN:]

        left, right, middle = (moved(parts) for parts in sides)
        found = np.hypot(0.5 * (left - right), 0.5 * (left + right) - middle)
        return float(np.hypot(usual[0], found[0])), float(np.hypot(usual[1], found[1]))

    @cached_property
    def _plain(self) -> VehicleModel:
        return self.model(self.seen[0].vehicle)

    def _place_disagreement(self, i: int, stated: ReadDrive, model_std: float) -> float:
        """Of the stated front share with that of drive i without it, in standard deviations of the difference."""
        if not stated.drive.statement.has_place or stated.stated.payload_kg == 0.0:
            return 0.0
        share, std = stated.stated.front_share, stated.stated.front_share_std
        mean, variance = (
            float(self.half_car.own[i][N_OWN + 1]),
            float(self.half_car.own_covariances[i][N_OWN + 1, N_OWN + 1]),
        )
        if self.seen[i].drive.statement.has_place:
            left = 1.0 / max(1.0 / variance - std**-2.0, 1e-3 / std**2)
            mean, variance = (mean / variance - share / std**2) * left, left
        return abs(mean - share) / float(np.sqrt(variance + std**2 + model_std**2))

    @cached_property
    def covariance(self) -> F64:
        """(n, n) of all parameters: roll moves with the half-car by -C I_rp."""
        upright = self.half_car.covariance[:N, :N]
        if self.rolling is None:
            return upright
        m = len(self.rolling.common)
        across = np.zeros((m, N))
        for one, own, rolled, moment in zip(
            self.seen, self.half_car.own, self.rolling.across, self.rolling.own, strict=True
        ):
            part = RollingDrive(one, one.theta(self.upright, own), load_of(own))
            point = part.point(self.rolling.common, moment)
            n = len(point.theta)
            whole = part.whittle.curvature(point, [*range(n), n + 2]).information
            crossed = part.chain(m).T @ whole[N:, :N]
            across -= self.rolling.covariance @ crossed[:m] + np.outer(rolled[:, 0], crossed[m])
        beside = across @ upright
        return np.block([[upright, beside.T], [beside, self.rolling.covariance + beside @ across.T]])

    def model(self, vehicle: Vehicle) -> VehicleModel:
        """The vehicle, its intervals not yet tested on any drive left out."""
        return self._model(vehicle, self.theta, self.covariance)

    def without(self, one: ReadDrive, vehicle: Vehicle) -> tuple[VehicleModel, F64, F64]:
        """The vehicle as the other drives teach it, from the result of all; roll as all of them show it. With it the
        mean and the covariance of the common causes.
        """
        others = [i for i, each in enumerate(self.seen) if each is not one]
        seen, own = [self.seen[i] for i in others], [self.half_car.own[i] for i in others]
        found = fit.most_probable(self.half_car.common, self.prior.upright(len(self.causes)), _at(seen, own), FINE)
        theta, covariance = self.theta, self.covariance.copy()
        theta[:N], covariance[:N, :N] = found.common[:N], found.covariance[:N, :N]
        covariance[N:, :N] = covariance[:N, N:] = 0.0
        fitted = replace(self, seen=seen, half_car=found)
        return fitted._model(vehicle, theta, covariance), found.common[N:], found.covariance[N:, N:]

    def _model(self, vehicle: Vehicle, theta: F64, covariance: F64) -> VehicleModel:
        reading = self.seen[0].whittle.spectra.reading
        batches = [batch for one in self.seen for batch in one.drive.batches if not batch.rejected]
        points = [one.point(theta[:N], own) for one, own in zip(self.seen, self.half_car.own, strict=True)]
        misfits = [one.whittle.misfit(point) for one, point in zip(self.seen, points, strict=True)]
        loads = tuple(load_of(own) for own in self.half_car.own)
        like = self.prior.like
        model_errors = ModelErrors.usual(vehicle.empty_mass_kg, most_misfit(misfits))
        stated = [one.stated.payload_kg for one in self.seen if not one.is_unknown]
        speeds = [batch.mean_speed_mps for batch in batches]
        model = VehicleModel(
            empty_mass_kg=vehicle.empty_mass_kg,
            empty_front_share_pct=vehicle.empty_front_share_pct,
            wheelbase_m=vehicle.wheelbase_m,
            band_hz=reading.band_hz,
            n_segment=reading.n_segment,
            names=NAMES[: len(theta)],
            parameters=theta,
            covariance=0.5 * (covariance + covariance.T),
            directions=np.zeros((len(theta), 0)),
            model_std=model_errors.model_std,
            spread=model_errors.spread,
            misfit_limit=model_errors.misfit_limit,
            acceleration_rms_mps2=float(np.median([one.spectra.acceleration_rms_mps2 for one in self.seen])),
            pitch_rate_rms_radps=float(np.median([one.spectra.pitch_rate_rms_radps for one in self.seen])),
            speed_seen_mps=(min(speeds), max(speeds)),
            taught_loads=loads,
            usual_log_amplitude=float(reading.usual_log_amplitude or 0.0),
            usual_stroke_mps=self.usual_mps,
            warnings=(SPRINGS_FROM_PRIORS,) if like is None and len({*stated}) <= 1 and len(loads) == 1 else (),
            track_width_m=vehicle.track_width_m,
            sensor_left_m=vehicle.sensor_left_m,
            sensor_left_std_m=vehicle.sensor_left_std_m,
            least_slack=self.seen[0].ground.least_slack,
            gravity_mps2=fmean(batch.gravity_mps2 for batch in batches),
            floor=usual_floor(batches, with_roll=reading.with_roll),
            gyro_gain=joined_gains([batch.gyro_gain for batch in batches]),
        )
        return model if like is None else _in_ranges_of(like, model)


def _in_ranges_of(sister: VehicleModel, model: VehicleModel) -> VehicleModel:
    """The model, valid over the speeds, roads and loads of its sister too."""
    slow, fast = zip(sister.speed_seen_mps, model.speed_seen_mps, strict=True)
    return replace(
        model,
        speed_seen_mps=(min(slow), max(fast)),
        acceleration_rms_mps2=sister.acceleration_rms_mps2,
        pitch_rate_rms_radps=sister.pitch_rate_rms_radps,
        taught_loads=(*sister.taught_loads, *model.taught_loads),
    )


def load_of(own: F64) -> Load:
    return Load(float(own[N_OWN]), 100.0 * float(own[N_OWN + 1]))


def fit_drives(
    known: Sequence[ReadDrive],
    causes: tuple[str, ...],
    prior: Prior,
    step: Callable[[], None],
    before: FitOfDrives | None,
) -> FitOfDrives:
    """The most probable vehicle of all drives together: the best of several starts, or from the fit ``before``; then
    roll and half-car in turn.
    """
    with_roll = known[0].spectra.has_roll
    upright = prior.upright(len(causes))
    seen = list(known)
    if with_roll:
        theta, usual_mps = (prior.mean, None) if before is None else (before.theta, before.usual_mps)
        seen = [one.seen_by(theta, usual_mps, one.stated.load) for one in known]
    if before is None:
        starts = STARTS[:1] if prior.like else STARTS
        tried = []
        for springs, dampers in starts:
            common = upright.mean.copy()
            for end in ("front", "rear"):
                common[INDEX[f"spring_{end}_npm"]] += springs
                common[INDEX[f"damper_{end}_nspm"]] += dampers
            tried.append(fit.most_probable(common, upright, _at(seen, [one.own_prior.mean for one in seen]), ROUGH))
            step()
        found = min(tried, key=lambda one: one.cost)
    else:
        start = _at(seen, before.half_car.own)
        found = fit.most_probable(before.half_car.common, upright, start, ROUGH)
    found = _lifted(seen, upright, found)
    if not with_roll:
        found = fit.most_probable(found.common, upright, _at(seen, found.own), FINE)
        return FitOfDrives(seen, causes, found, None, prior, None)
    of_roll = fit.Gaussian.of(prior.mean[N:], prior.covariance[N:, N:])
    usual_mps = prior.like.usual_stroke_mps if prior.like else None
    rolling = _roll(seen, found, of_roll, prior.mean[N:])
    for _ in range(TURNS - 1):
        if usual_mps is None:
            strokes = [
                one.log_strokes(found.common[:N], load_of(own)) for one, own in zip(seen, found.own, strict=True)
            ]
            front, rear = np.median(strokes, axis=0).tolist()
            usual_mps = exp(front), exp(rear)
        theta = np.r_[found.common[:N], rolling.common]
        for one, moment in zip(seen, rolling.own, strict=True):
            one.moment_kgm = float(moment[0])
        seen = [one.seen_by(theta, usual_mps, load_of(own)) for one, own in zip(seen, found.own, strict=True)]
        found = fit.most_probable(found.common, upright, _at(seen, found.own), FINE)
        rolling = _roll(seen, found, of_roll, rolling.common)
    return FitOfDrives(seen, causes, found, rolling, prior, usual_mps)


def _at(seen: Sequence[ReadDrive], own: Sequence[F64]) -> list[fit.Drive]:
    return [fit.Drive(one, one.own_prior, x) for one, x in zip(seen, own, strict=True)]


def _lifted(seen: Sequence[ReadDrive], upright: fit.Gaussian, found: fit.Found) -> fit.Found:
    """The peak that was found, its drives lifted out of false peaks of their own: another load, a softer mount."""
    for _ in range(RESEEDS):
        own, n_moved = _reseeded(seen, found)
        if not n_moved:
            break
        found = fit.most_probable(found.common, upright, _at(seen, own), ROUGH)
    return found


def _reseeded(seen: Sequence[ReadDrive], found: fit.Found) -> tuple[list[F64], int]:
    """The drives' own vectors, each at the best of the peaks that a grid of loads, firm and soft, leads to; and how
    many moved.
    """
    every, n_moved = [], 0
    soft = log(SOFT_HZ) - float(found.common[INDEX["payload_mode_hz"]])
    for one, here in zip(seen, found.own, strict=True):
        least, best = one.cost(found.common, here) + one.own_prior.cost(here), here
        if not one.stated.is_compact:
            for mode in (0.0, soft):
                start = _seed(one, found.common, mode)
                there = fit.climb(OfVehicle(one, found.common), one.own_prior, start, ROUGH, least)
                if there.cost < least - RESEED_GAIN:
                    least, best = there.cost, there.own[0]
        n_moved += best is not here
        every.append(best)
    return every, n_moved


def _seed(one: ReadDrive, theta: F64, mode: float) -> F64:
    """The start of a drive's own vector: of a grid of loads the one that fits a vehicle best."""
    start = one.own_prior.mean.copy()
    start[MODE] = mode
    if not one.is_unknown:
        return start
    vehicle = one.vehicle
    n_payloads, places = SEEDS
    most_kg = max(vehicle.payload_range_kg[1], vehicle.empty_mass_kg / 3.0)
    starts = []
    for payload_kg in np.linspace(0.0, most_kg, n_payloads).tolist():
        for place in places if payload_kg else (0.5,):
            own = start.copy()
            front_kg = vehicle.empty_front_share * vehicle.empty_mass_kg + (1.0 - place) * payload_kg
            own[N_OWN:] = payload_kg, front_kg / (vehicle.empty_mass_kg + payload_kg)
            starts.append(own)
    costs = one.whittle.costs([one.point(theta, own) for own in starts]) + [one.own_prior.cost(own) for own in starts]
    return starts[int(np.argmin(costs))]


def _roll(seen: Sequence[ReadDrive], found: fit.Found, prior: fit.Gaussian, start: F64) -> fit.Found:
    """The most probable roll parameters, the half-car as found, with each drive's moment about the centre line."""
    drives = []
    for one, own in zip(seen, found.own, strict=True):
        std_kgm = abs(own[N_OWN]) * one.stated.left_std_m + LEAST_MOMENT_STD_KGM
        moment_kgm = np.array([own[N_OWN] * one.stated.left_m])
        drives.append(
            fit.Drive(
                RollingDrive(one, one.theta(found.common, own), load_of(own)),
                fit.Gaussian(moment_kgm, np.array([[std_kgm**-2.0]])),
                moment_kgm,
            )
        )
    return fit.most_probable(start, prior, drives, FINE)


def directions_of(model: VehicleModel, vehicle: Vehicle, fitted: FitOfDrives) -> F64:
    """(n, k) with independent causes of unit variance as columns: those that move the loads of these drives most."""
    shapes = shape_hypotheses(vehicle, *model.known_shape)
    rows = []
    for one in fitted.seen:
        answers = answers_by_vehicle(mixture_of(one.read(model.reading), model, shapes), model)
        rows.append(answers / SCALES[: len(answers), None])
    values, vectors = np.linalg.eigh(model.covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    _, _, directions = np.linalg.svd(np.concatenate(rows) @ root, full_matrices=False)
    return np.asarray(root @ directions[:MOST_DIRECTIONS].T)


def weighed_left_out(one: ReadDrive, model: VehicleModel, truth_kg: tuple[float, float]) -> list[LeftOut]:
    """Every batch of a drive, weighed by a vehicle that it has not taught. ``truth_kg`` is what its statements say of
    the payload once their common errors are known, with its standard deviation.
    """
    drive, stated = one.drive, one.stated
    shapes = known_shape(*model.known_shape) if stated.is_compact else shape_hypotheses(one.vehicle, *model.known_shape)
    found = []
    is_among = reach_of(stated.load, model) == 0.0
    for batch in drive.batches:
        weighed = None if batch.rejected else weigh(batch, model, shapes)
        if weighed is None or isinstance(weighed, Why) or weighed.signs.tension > MOST_TENSION:
            continue  # the service would refuse it
        posterior = weighed.posterior
        true = np.array([truth_kg[0], 100.0 * stated.front_share, np.nan])
        is_placed = drive.statement.left_m is not None or stated.payload_kg == 0.0
        if posterior.size == 3 and is_placed:
            theta = weighed.mixture.point.theta
            true[2] = one.cg_left_m(theta, stated.payload_kg, stated.payload_kg * stated.left_m)
        if not drive.statement.has_place:
            true[1] = np.nan
        found.append(
            LeftOut(
                run=drive.name,
                error=posterior.mean - true[: posterior.size],
                stated_std=np.array([truth_kg[1], 100.0 * stated.front_share_std, 0.02])[: posterior.size],
                posterior=posterior,
                reach=weighed.signs.reach,
                misfit=weighed.signs.misfit if is_among else np.nan,
                is_compact=stated.is_compact,
            )
        )
    return found


def information_of(spectra: CrossSpectra, point: Point, ground: Ground, statement: Statement, vehicle: Vehicle) -> F64:
    """(N, N) what one more drive with these spectra, without a roll rate, would add to the vehicle's precision.

    The drive's own deviations and its load, of which ``statement`` is known, are eliminated as in the fit.
    """
    whole = Whittle(spectra, ground, EVIDENCE).curvature(point, range(N + 2)).information
    own, prior = [*OWN, N, N + 1], own_prior(load_prior_of(statement, vehicle), vehicle)
    across = whole[:N, own]
    told = whole[:N, :N] - across @ np.linalg.solve(whole[np.ix_(own, own)] + prior.precision, across.T)
    return np.asarray(0.5 * (told + told.T), float)
