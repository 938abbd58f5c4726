"""The wanted frames of a table of recorded ones, and the counts of the others."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gateway.bus.logs.report import LogReport
from gateway.bus.signals import IdFilter
from gateway.records import I64, U32, Bool


def is_same_channel(recorded: object, wanted: str | None) -> bool:
    """Whether a recorded channel is the wanted one.

    A number, as python-can counts channels, matches a name that ends in it (1 and "can1"). A format that
    keeps no channel (.csv, .db) matches every name.
    """
    if wanted is None or recorded is None or str(recorded) == wanted:
        return True
    digits = re.search(r"\d+$", wanted)
    return isinstance(recorded, int) and digits is not None and int(digits[0]) == recorded


@dataclass(frozen=True, slots=True)
class Selection:
    """The frames that pass one of ``filters``, of ``channel`` or of all; the others are counted in ``report``."""

    filters: Sequence[IdFilter]
    channel: str | None
    report: LogReport

    def passes(self, can_id: U32) -> Bool:
        """Which identifiers (n,) are wanted."""
        passes = np.zeros(len(can_id), np.bool_)
        for id_filter in self.filters:
            passes |= id_filter.matches(can_id)
        return passes

    def rows(self, can_id: U32, channel: I64 | None, is_remote: Bool | None = None) -> I64:
        """Rows (m,) of the wanted data frames among all (n,), remote ones among them. A format may store no channel."""
        self.report.frames += len(can_id)
        rows = np.flatnonzero(self.passes(can_id))
        if is_remote is not None and is_remote[rows].any():
            self.report.remote_frames += int(np.count_nonzero(is_remote[rows]))
            rows = rows[~is_remote[rows]]
        if channel is None:
            return rows
        for number in set(channel[rows].tolist()):
            self.report.channels.add(str(number))
            if not is_same_channel(number, self.channel):
                is_other = channel[rows] == number
                self.report.other_channel += int(np.count_nonzero(is_other))
                rows = rows[~is_other]
        return rows
