"""The fleet's subscriber: the vehicles' records from the broker, in one database, and a page with a line per vehicle.

    python -m gateway.fleet.subscriber     # docs/fleet.md; settings from the environment

`springscale demo --fleet` shows it with simulated vehicles. Only this package imports SQLAlchemy; it does not run in a
vehicle.
"""

from gateway.fleet.book import Book, Message
from gateway.fleet.page import fleet_app, served

__all__ = ["Book", "Message", "fleet_app", "served"]
