"""The process that fits takes no more memory than it may, wherever it is told that: by the service, or from outside."""

import subprocess
import sys

import pytest

CODE = """
import resource
from gateway.calibration.commissioning.work import _take_little
if {outside}:
    resource.setrlimit(resource.RLIMIT_AS, ({outside}, {outside}))
_take_little(8000.0)
print(*resource.getrlimit(resource.RLIMIT_AS))
"""


@pytest.mark.parametrize(("outside", "most"), [(0, 8_000_000_000), (6_000_000_000, 6_000_000_000)])
def test_the_narrower_of_two_bounds_holds(outside: int, most: int) -> None:
    code = CODE.format(outside=outside)
    told = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert told.split() == [str(most)] * 2
