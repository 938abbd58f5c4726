"""Known weights, which condition every later estimate; verifications, which teach nothing; and what drifts.

A weight that somebody states comes in and is attached to the load epoch of its time, as the store has it; dated records
go out, each kind in a file of its own beside the database.
"""

from gateway.service.proving.proving import Proving

__all__ = ["Proving"]
