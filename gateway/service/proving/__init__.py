"""Known weights, which condition every later estimate; verifications, which change nothing; and the trend of the
parameters.

A stated weight is attached to the load epoch of its time, from the store; dated records go out, each kind in a file of
its own beside the database.
"""

from gateway.service.proving.proving import Proving

__all__ = ["Proving"]
