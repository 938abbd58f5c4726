"""The fleet's subscriber: records that vehicles sent to the broker, in one file, and a page with a line per vehicle.

deploy/fleet and `springscale demo --fleet` use it; it does not run in a vehicle.
"""

from gateway.fleet.book import Message, SqliteBook, address
from gateway.fleet.lines import Line, line_of
from gateway.fleet.page import FleetPage, fleet_app

__all__ = ["FleetPage", "Line", "Message", "SqliteBook", "address", "fleet_app", "line_of"]
