"""What a vehicle costs: bytes of its records and logs, computing to weigh it, messages its broker can take.

    python -m benchmarks.speed.footprint --output docs/footprint.json

docs/scale.md is computed from these figures. All are measured on records that the service's own pipeline makes of
simulated drives, each drive another; nothing is extrapolated here.
"""
