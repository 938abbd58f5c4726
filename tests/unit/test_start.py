"""What no start of the service may import: seconds of it, for what a vehicle does not need then."""

import json
import subprocess
import sys

HEAVY = (
    "scipy.stats",
    "scipy.signal",
    "scipy",
    "asammdf",
    "pandas",
    "matplotlib",
    "numba",
    "pyarrow",
)


def test_the_service_starts_without_what_it_does_not_need():
    code = "import json, sys, gateway.service.gateway; print(json.dumps(sorted(sys.modules)))"
    loaded = json.loads(subprocess.run([sys.executable, "-c", code], check=True, capture_output=True).stdout)
    assert not set(HEAVY) & set(loaded)
