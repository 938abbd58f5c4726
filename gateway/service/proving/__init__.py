"""Known weights held against what was weighed: verifications, which teach nothing; tickets, which do; and what drifts.

A weight that somebody states comes in and is attached to the load epoch of its time, as the store has it; dated records
go out, kept beside the database as tares are.
"""

from gateway.service.proving.proving import Proving
from gateway.service.proving.ticket_desk import TicketDesk

__all__ = ["Proving", "TicketDesk"]
