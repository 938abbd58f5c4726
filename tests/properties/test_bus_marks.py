"""The marks of candump lines are found whatever stands around them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from gateway.bus.logs.candump import _Finder


@given(st.lists(st.text("#0\n", max_size=40).map(str.encode), min_size=1, max_size=4))
def test_a_mark_is_every_first_of_a_row_of_marks(texts):
    """One finder for texts of any length, one after the other: what it noted of one leaves no trace in the next."""
    finder = _Finder()
    for text in texts:
        found = finder.marks(np.frombuffer(text, np.uint8))
        assert found.tolist() == [i for i, byte in enumerate(text) if byte == 35 and (i == 0 or text[i - 1] != 35)]
        assert np.count_nonzero(finder.are(np.frombuffer(text, np.uint8), "\n")) == text.count(b"\n")
