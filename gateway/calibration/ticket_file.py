"""tickets.json: known weights that the vehicle's own calibration learns from, and the fits made with them."""

from typing import Annotated, Final, Literal

from pydantic import Field

from gateway.calibration.commissioning.job import Planned
from gateway.calibration.file.calibration_file import content_id
from gateway.calibration.file.parts import Part
from gateway.stated_weight import StatedWeight

FILE_NAME: Final = "tickets.json"
MOST_TICKETS: Final = 100  # the oldest that were withdrawn are forgotten beyond
MOST_FITS: Final = 50

Finite = Annotated[float, Field(allow_inf_nan=False)]


class Withdrawal(Part):
    """When and by whom a ticket was taken back."""

    at: str
    by: str


class Ticket(Part):
    """A known weight, the load epoch that it is of, and what it makes known; ``id`` is the hash of all but its end."""

    id: str
    at: str
    by: str
    note: str | None
    base_id: str = Field(description="the commissioned calibration that it improves")
    stated: StatedWeight
    t_start: str = Field(description="of the load epoch")
    t_end: str
    batch_ids: tuple[str, ...] = Field(min_length=1, description="kept batches of that load")
    payload_kg: Finite
    front_share_pct: Finite | None = Field(description="null: nobody said where it lies, and so it teaches nothing")
    withdrawn: Withdrawal | None = None

    @property
    def teaches(self) -> bool:
        """Whether a fit takes it."""
        return self.withdrawn is None and self.front_share_pct is not None

    def content_id(self) -> str:
        """What ``id`` has to be."""
        return content_id(self.model_dump(mode="json", exclude={"id", "withdrawn"}))


class TicketFit(Part):
    """What came of fitting the empty drive with these tickets; none: what the empty drive alone promises."""

    at: str
    base_id: str
    ticket_ids: tuple[str, ...]
    calibration_id: str | None = None
    planned: Planned | None = None
    fault: str | None = None


class TicketHistory(Part):
    """All that is remembered, oldest first."""

    format: Literal["springscale-tickets"] = "springscale-tickets"
    version: Literal[1] = 1
    tickets: tuple[Ticket, ...] = ()
    fits: tuple[TicketFit, ...] = ()

    def with_ticket(self, ticket: Ticket) -> "TicketHistory":
        """With one more; standing ones are never forgotten."""
        ended = [one for one in self.tickets if one.withdrawn is not None]
        forgotten = {one.id for one in ended[: max(0, len(self.tickets) + 1 - MOST_TICKETS)]}
        kept = tuple(one for one in self.tickets if one.id not in forgotten)
        return self.model_copy(update={"tickets": (*kept, ticket)})

    def withdrawn(self, ticket_id: str, end: Withdrawal) -> "TicketHistory":
        """With this one taken back."""
        tickets = tuple(
            one.model_copy(update={"withdrawn": end}) if one.id == ticket_id else one for one in self.tickets
        )
        return self.model_copy(update={"tickets": tickets})

    def with_fit(self, fit: TicketFit) -> "TicketHistory":
        """With what came of a fit."""
        return self.model_copy(update={"fits": (*self.fits, fit)[-MOST_FITS:]})

    def teaching(self, base_id: str) -> tuple[Ticket, ...]:
        """Tickets that a fit on this base takes."""
        return tuple(one for one in self.tickets if one.base_id == base_id and one.teaches)

    def fit_of(self, base_id: str, tickets: tuple[Ticket, ...]) -> TicketFit | None:
        """The last fit of exactly these; None: it is still to be made."""
        wanted = (base_id, tuple(one.id for one in tickets))
        return next((one for one in reversed(self.fits) if (one.base_id, one.ticket_ids) == wanted), None)
