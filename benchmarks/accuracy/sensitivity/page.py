"""The page of the sensitivity study, from its numbers alone."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from benchmarks.accuracy.markdown import page, table
from benchmarks.accuracy.sensitivity.constants import CONSTANTS, FACTORS, Constant
from benchmarks.accuracy.sensitivity.study import AS_IT_IS, setting

WEIGHED: Final = (
    "Constant", "times", "Payload, mean abs. error %", "Share, mean abs. error %", "Payload held", "Share held",
    "Payload, +- %", "score %", "Share, +- %", "score %",
    "Refused", "Change of load that shows, kg", "Changes seen where none was",
)  # fmt: skip
INSPECTED: Final = ("Constant", "times", "Right ones doubted", "Wrong ones named")


def sensitivity_page(found: Mapping[str, Any]) -> str:
    """The page in Markdown, from Sensitivity.to_json."""
    usual = found["weighing"][AS_IT_IS]
    return page(
        "Sensitivity",
        f"sensitivity --output DIR --vans {found['n_vans']} --seed {found['seed']}",
        "Some constants follow from no derivation. Here each is halved and doubled in turn, all else as it is, on "
        f"{found['n_vans']} simulated vans that were not used to choose any setting: calibrated on six known "
        f"loads, then driven "
        "once in each of the ways of [coverage](coverage.md), each time with another load. Errors are percent of "
        "the rated payload and of 20 percentage points, over batches that were answered; held is the share of "
        "these whose 95 % interval holds the truth, +- the mean of half these intervals, and the score that of "
        "their width and 40 times what the truth lies outside.",
        "",
        *table(WEIGHED, [_weighed_cells("as they are", "1", usual), *_rows(found["weighing"], _weighed_cells)]),
        "",
        "## Smallest detectable change of load",
        "",
        f"Between two batches of five minutes, a change of {usual['smallest_change_kg']:.0f} kg (median) is "
        "noticed every other time if the front share stays; a change of the share helps. Of the pairs of batches "
        f"with one load {usual['n_false']} of {usual['n_unchanged']} were taken for two; of those with loads "
        f"further apart than that {usual['n_seen']} of {usual['n_changed']} were.",
        "",
        "## Inspection",
        "",
        "The known drives of the same vans: as they are, with a third of the rated payload missing on the label of "
        "the heaviest, and with the pitch rate turned over.",
        "",
        *table(
            INSPECTED,
            [
                _inspected_cells("as they are", "1", found["inspection"][AS_IT_IS]),
                *_rows(found["inspection"], _inspected_cells),
            ],
        ),
        "",
        "## What each decides",
        "",
        *(_decided(one, found["constants"][one.name]) for one in CONSTANTS if one.name in found["constants"]),
        "",
    )


def _rows(found: Mapping[str, Any], cells: Any) -> list[list[str]]:
    return [
        cells(f"`{one.name}`", f"{factor:g}", found[setting(one, factor)])
        for one in CONSTANTS
        for factor in FACTORS
        if setting(one, factor) in found
    ]


def _weighed_cells(name: str, times: str, of_setting: Mapping[str, Any]) -> list[str]:
    line = of_setting["line"]
    smallest_kg = of_setting["smallest_change_kg"]
    return [
        name,
        times,
        *(_number(line[f"{quantity}_mean_abs_pct"]) for quantity in ("payload", "front_share")),
        *(_share(line[f"{quantity}_coverage"]) for quantity in ("payload", "front_share")),
        *(
            _number(line[f"{quantity}_{what}_pct"])
            for quantity in ("payload", "front_share")
            for what in ("half_width", "interval_score")
        ),
        f"{line['n_rejected']} of {line['n_batches']}",
        "–" if smallest_kg is None else f"{smallest_kg:.0f}",
        f"{of_setting['n_false']} of {of_setting['n_unchanged']}",
    ]


def _inspected_cells(name: str, times: str, counted: Mapping[str, int]) -> list[str]:
    return [
        name,
        times,
        f"{counted['n_doubted']} of {counted['n_right']}",
        f"{counted['n_named']} of {counted['n_wrong']}",
    ]


def _decided(constant: Constant, was: Sequence[float]) -> str:
    numbers = ", ".join(f"{x:g}" for x in was)
    return f"- `{constant.name}` ({numbers}), in {constant.acts}: {constant.decides}."


def _number(x: float | None) -> str:
    return "–" if x is None else f"{x:.2f}"


def _share(coverage: Mapping[str, Any] | None) -> str:
    return "–" if coverage is None else f"{100.0 * coverage['share']:.0f} %"
