"""Studies as tables for people. A dash stands for what there is none of."""

from collections.abc import Sequence

from gateway.calibration.advice_study import AdviceStudy, Comparison
from gateway.calibration.judgement.learning_curve import LearningCurve, Rung, Spread

_HEAD = (
    f"{'runs':>4}  {'estimator':15}{'tried':>6}{'refused':>8}   {'judged on':11}"
    f"{'payload error':>15}{'worst':>8}{'covered':>9}{'share error':>15}{'worst':>8}{'covered':>9}{'rejected':>10}"
)


def learning_curve_table(curve: LearningCurve) -> str:
    """Mean errors over the subsets tried, +- their standard deviation between subsets."""
    lines = [
        f"{curve.campaign}: mean |error| in percent of the ranges (12), +- its spread between choices of runs",
        _HEAD,
        *_rung_lines(curve.rungs),
        "",
        "every triple of the empty run and two loads at different positions",
        _HEAD,
        *_rung_lines(curve.triple_rungs),
        "",
        "left out: all batches of runs that calibration did not see; later part: the validation part of every run",
    ]
    return "\n".join(lines)


def advice_table(found: AdviceStudy) -> str:
    """Errors before and after a fourth run: the one advised, the others, and the best and worst by hindsight."""
    return "\n".join(
        [
            f"{found.campaign}: mean |error| of payload and share in percent (12), validation part of all runs, "
            f"over {found.with_misses.n_choices} triples of runs",
            f"{'':26}{'rejected counts as mid-range':>30}{'answered batches only':>30}",
            *(
                f"{what:26}{_pair(found.with_misses, key):>30}{_pair(found.answered, key):>30}"
                for what, key in (
                    ("three runs", "before"),
                    ("and the advised fourth", "advised"),
                    ("and another, on average", "others"),
                    ("and the least useful", "least"),
                    ("best by hindsight", "best"),
                    ("worst by hindsight", "worst"),
                )
            ),
            f"{'advised beats the average':26}{_often(found.with_misses):>30}{_often(found.answered):>30}",
        ]
    )


def _pair(comparison: Comparison, key: str) -> str:
    payload, share = getattr(comparison, key)
    return f"{payload:.2f} %  {share:.2f} %"


def _often(comparison: Comparison) -> str:
    payload, share = comparison.better_share
    return f"{100 * payload:.0f} %   {100 * share:.0f} %"


def _rung_lines(rungs: Sequence[Rung]) -> list[str]:
    return [line for rung in rungs for line in _both_lines(rung)]


def _both_lines(rung: Rung) -> list[str]:
    first = f"{rung.n_runs:>4}  {rung.estimator:15}{rung.n_subsets:>6}{rung.n_refused:>8}   "
    rest = " " * len(first)
    judged = [("left out", rung.left_out), ("later part", rung.validation)]
    shown = [(where, spread) for where, spread in judged if spread.n_trials]
    if not shown:
        return [first + "no calibration"]
    return [
        (first if i == 0 else rest) + f"{where:11}" + _spread_cells(spread) for i, (where, spread) in enumerate(shown)
    ]


def _spread_cells(spread: Spread) -> str:
    return (
        _with_spread(spread.payload_mean_pct, spread.payload_std_pct)
        + _percent(spread.payload_worst_pct, 8, 1)
        + _percent(_hundredfold(spread.payload_coverage95), 9, 0)
        + _with_spread(spread.front_share_mean_pct, spread.front_share_std_pct)
        + _percent(spread.front_share_worst_pct, 8, 1)
        + _percent(_hundredfold(spread.front_share_coverage95), 9, 0)
        + _percent(_hundredfold(spread.rejected_share), 10, 0)
    )


def _with_spread(mean: float | None, std: float | None) -> str:
    text = "-" if mean is None or std is None else f"{mean:.1f} +- {std:.1f} %"
    return f"{text:>15}"


def _percent(number: float | None, width: int, digits: int) -> str:
    text = "-" if number is None else f"{number:.{digits}f} %"
    return f"{text:>{width}}"


def _hundredfold(share: float | None) -> float | None:
    return None if share is None else 100.0 * share
