"""What a driver has to know at a glance: how much can still be loaded, whether it is too much, and how old that is."""

from gateway.web.routes.cab.cab import cab_router
from gateway.web.routes.cab.shapes import Cab, CabEvent, LoadKnown, RoomLeft

__all__ = ["Cab", "CabEvent", "LoadKnown", "RoomLeft", "cab_router"]
