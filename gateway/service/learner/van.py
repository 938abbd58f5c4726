"""The vehicle that is learnt: as the service was given it, as somebody stated it, and its sister."""

from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from gateway.calibration.axle_weights import payload_range_keys
from gateway.calibration.file import load_calibration
from gateway.calibration.fitter_answers import doubts_of, vehicle_table
from gateway.calibration.sister import require_alike, sister_in
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationFileError, CampaignError, NoSisterError, RefusedError
from gateway.log import Event
from gateway.service.learner.learning_file import Book, Sister, Stated
from gateway.stated.doubt import Doubt
from gateway.stated.facts import VehicleAnswers
from gateway.stated.learning import SisterTold, StatedVehicle


@dataclass(frozen=True, slots=True)
class LearnerVehicle:
    """The vehicle as the service knows it, and whether the service may learn it.

    ``like`` is the calibration file of its sister, ``sister`` the vehicle in it. ``by_file`` is the calibration file
    that the settings name, ``in_file`` the vehicle in it; None without one.
    """

    id: str
    name: str
    signals_id: str
    why_not_allowed: str | None = None
    is_name_fixed: bool = False
    like: Path | None = None
    sister: Vehicle | None = None
    by_file: Path | None = None
    in_file: Vehicle | None = None

    def stated(self, answers: VehicleAnswers) -> Vehicle:
        """The vehicle that follows from what somebody stated. Raises CampaignError, NoSisterError.

        What it may carry follows from its limit unless it is stated.
        """
        if answers.payload_range_kg is None:
            axles_kg = answers.kerb_front_axle_kg, answers.kerb_rear_axle_kg
            answers = replace(answers, **payload_range_keys(*axles_kg, answers.gross_limit_kg))
        table = vehicle_table(answers, self.name, self.sister)
        if self.sister is not None and not doubts_of(answers, self.sister):
            require_alike(self.sister, table)
        return replace(table, name=self.name) if self.is_name_fixed else table


class StatedVan:
    """What is known of the vehicle, and who said so. ``given`` is what the settings say. Thread-safe."""

    def __init__(self, book: Book, given: LearnerVehicle) -> None:
        self._book, self.given = book, given

    @property
    def named(self) -> LearnerVehicle:
        """The vehicle with its sister: the one that somebody handed in, else that of the settings."""
        given = self._book.record.sister
        if given is None:
            return self.given
        return replace(self.given, like=self._book.directory / given.file_name, sister=given.vehicle)

    @property
    def learnt(self) -> Vehicle | None:
        """The vehicle to learn; None if it is not stated, or in doubt."""
        stated = self._book.record.vehicle
        if stated is None or (self._doubts(stated) and stated.confirmed is None):
            return None
        try:
            return self.named.stated(stated.figures)
        except (CampaignError, NoSisterError):  # see fault
            return None

    @property
    def known(self) -> Vehicle | None:
        """The vehicle that statements are compared with: as stated, else as in the file of the settings."""
        return self.learnt or self.given.in_file

    @property
    def fault(self) -> str | None:
        """What is wrong if the box was moved, so that it would weigh this vehicle by another one's springs, or if the
        settings name another sister since.
        """
        stated = self._book.record.vehicle
        if stated is None:
            return None
        if stated.vehicle_id not in (None, self.given.id):
            return (
                f"what was learnt is of {stated.vehicle_id}, and [vehicle] id is {self.given.id}: give another vehicle "
                "another [store] directory; if only the id has changed, state the vehicle again"
            )
        try:
            self.named.stated(stated.figures)
        except (CampaignError, NoSisterError) as fault:
            return f"nothing is learnt: {fault}"
        return None

    def _doubts(self, stated: Stated) -> list[Doubt]:
        return list(doubts_of(stated.figures, self.named.sister))

    def told(self) -> StatedVehicle | None:
        """The vehicle as somebody stated it; None if nobody has."""
        stated = self._book.record.vehicle
        if stated is None:
            return None
        return StatedVehicle(
            figures=stated.figures,
            by=stated.by,
            at=stated.at,
            doubts=self._doubts(stated),
            is_confirmed=stated.confirmed is not None,
        )

    def state(self, answers: VehicleAnswers, by: str, *, is_confirmed: bool) -> None:
        """State the vehicle's figures; ``is_confirmed``: they are right, although unusual. Raises RefusedError."""
        self.require_allowed()
        try:
            self.named.stated(answers)
        except NoSisterError as fault:
            raise RefusedError("not_its_sister", str(fault)) from None
        except CampaignError as fault:
            raise RefusedError("vehicle_unusable", str(fault)) from None
        with self._book.lock:
            act = self._book.act(by)
            confirmed = act if is_confirmed else None
            stated = Stated(figures=answers, at=act.at, by=by, confirmed=confirmed, vehicle_id=self.given.id)
            self._book.save(self._book.record.model_copy(update={"vehicle": stated}))
            self._book.tell(Event.VEHICLE_STATED, {"by": by})

    def sister(self) -> SisterTold | None:
        """The vehicle of the same model whose calibration is the prior."""
        given, named = self._book.record.sister, self.named.sister
        if named is None:
            return None
        return SisterTold(name=named.name, calibration_id=given and given.id)

    def state_sister(self, content: bytes, by: str) -> None:
        """Take the calibration file of a vehicle of the same model as the prior of the next fits. Raises RefusedError
        for another file, or one of another model.
        """
        self.require_allowed()
        try:
            held = load_calibration("the file", lambda path: content)
            sister_in(held)
            with self._book.lock:
                if (stated := self._book.record.vehicle) is not None:
                    replace(self.given, sister=held.vehicle).stated(stated.figures)
                self._keep_sister(self._book.write_sister(content, held, by), by)
        except CalibrationFileError as fault:
            raise RefusedError("unreadable", str(fault)) from None
        except (NoSisterError, CampaignError) as fault:
            raise RefusedError("not_its_sister", str(fault)) from None

    def forget_sister(self, by: str) -> None:
        """Learn again without the calibration that somebody handed in, or with that of the settings."""
        self.require_allowed()
        with self._book.lock:
            self._keep_sister(None, by)

    def _keep_sister(self, sister: Sister | None, by: str) -> None:
        self._book.save(self._book.record.model_copy(update={"sister": sister}))
        self._book.tell(Event.SISTER_STATED, {"by": by, "calibration_id": sister and sister.id})
        with suppress(OSError):
            self._book.forget_others()

    def require_allowed(self) -> None:
        if self.given.why_not_allowed is not None:
            raise RefusedError("not_allowed", self.given.why_not_allowed)
