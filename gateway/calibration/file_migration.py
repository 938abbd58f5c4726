"""How the content of an older calibration file becomes that of today's. What it did not say stays unknown: null."""

import copy
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final

Content = dict[str, Any]

FIRST_VERSION: Final = 1


def _to_version_2(content: Content) -> None:
    """Version 2 says over which roads it was calibrated, and the expected errors of every estimator."""
    content["seen"]["roughness_mps2"] = None
    for estimator in ("cross_spectrum", "ratio_index"):
        if content[estimator] is not None:
            content["expected_errors"].setdefault(estimator, {"payload_rms_kg": None, "front_share_rms_pct": None})


# Entry v turns version v into v + 1. Entries are never edited, only added.
MIGRATIONS: Final[Mapping[int, Callable[[Content], None]]] = MappingProxyType({1: _to_version_2})


def migrated(content: Content, version: int) -> Content:
    """``content`` as ``version`` has it, with the id it had in ``migrated_from``; the same object where it is that.

    ``content["version"]`` must lie between FIRST_VERSION and ``version``. Raises KeyError, TypeError or
    AttributeError where the content has not the shape of its version.
    """
    if content["version"] == version:
        return content
    current = copy.deepcopy(content)
    current["migrated_from"] = content.get("migrated_from") or content["id"]
    for step in range(content["version"], version):
        MIGRATIONS[step](current)
        current["version"] = step + 1
    return current
