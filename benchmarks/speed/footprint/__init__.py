"""The cost of a vehicle: bytes of its records and logs, processing time, and messages that its broker can handle.

    python -m benchmarks.speed.footprint --output docs/footprint.json

docs/scale.md is computed from these figures. All are measured on records that the service's own pipeline makes of
simulated drives, each drive another; nothing is extrapolated here.
"""
