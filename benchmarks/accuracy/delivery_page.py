"""The page of the load events, from the numbers of the delivery study alone."""

from collections.abc import Mapping
from typing import Any, Final

from benchmarks.accuracy.delivery_days import Said
from benchmarks.accuracy.markdown import page, score_cell

ROWS: Final = (
    ("true_above_5_std", "true change above 5 standard deviations"),
    ("true_3_to_5_std", "true change of 3 to 5"),
    ("true_below_3_std", "true change below 3"),
    ("found_above_3_std", "of all these, measured above 3"),
    ("stops_without_change", "stop without a change"),
    ("under_way", "between two batches of one drive"),
)

SAID: Final = ((Said.NOTHING, "nothing"), (Said.CARRIES, "that it carries parcels"))


def delivery_page(found: Mapping[str, Any]) -> str:
    """The page in Markdown."""
    said = found["said"][Said.CARRIES]
    kg, trips, told = said["kg"], said["trips"], said["found"]
    n_invented = told["stops_without_change"]["n_told"] + told["under_way"]["n_told"]
    plain = told["found_above_3_std"]
    return page(
        "Load events: how well they are found",
        f"delivery --seeds {len(found['vans'])} --seed {found['seed']} --output DIR",
        f"{len(found['vans'])} simulated delivery days, each of another van that was not used to choose any "
        f"setting. It is "
        "calibrated on six known loads, its campaign says that it carries parcels, and it is "
        "a little another one on its day: worn, warm, on other tyres. It leaves empty and makes 8 "
        "stops: loading, four deliveries, one pick-up, and two at which nothing happens. "
        "Legs last five to fifteen minutes, in town and in the country, on roads of changing roughness. The bus "
        "sleeps at stops and no door is mapped, so that only the weight shows what happened. Events are judged by "
        "their last revision, batch by batch as the service makes them.",
        "",
        "## Found, and invented",
        "",
        "Standard deviations are those that the event states.",
        "",
        "| What lay between two weighings | how often | told as an event |",
        "|---|---|---|",
        *(f"| {words} | {told[name]['n']} | {told[name]['n_told']} |" for name, words in ROWS),
        "",
        f"Of {plain['n']} changes that were measured above three standard deviations, {plain['n_told']} were told; "
        f"{n_invented} events were invented. Half of the changes of exactly three standard deviations are measured "
        "as less: they cannot all be found without inventing others.",
        "",
        "## Kilograms",
        "",
        "| Changes told | mean abs. error | of the change | bias | stated std (mean) | mean z squared "
        "| within 95 % interval |",
        "|---|---|---|---|---|---|---|",
        f"| {kg['n']} | {kg['mean_abs_kg']:.1f} kg | {kg['mean_abs_pct']:.0f} % | {kg['bias_kg']:+.1f} kg | "
        f"{kg['mean_std_kg']:.1f} kg | {kg['mean_z2']:.2f} | {_share(kg['n_held'], kg['n'])} |",
        "",
        "Where two stops lie between weighings, the change is that of both together.",
        "",
        "## The shape of the load",
        "",
        "These vans were calibrated with each load in one place; their parcels lie all along the floor, and some "
        "are high. Unless the campaign states what the vehicle carries (`carries`), the prior gives half of all loads "
        "the shape of the known ones. "
        "([method](method.md#weighing-gatewaycorecross_spectrumestimatorpy)). Batches by themselves, in percent "
        "of the rated payload; the interval score is the width of the 95 % interval and 40 times what the truth "
        "lies outside, in brackets what it would be for normal errors and intervals of the right width:",
        "",
        "| campaign says | batches | mean abs. error | bias | +- (mean) | interval score | within 95 % interval |",
        "|---|---|---|---|---|---|---|",
        *(_batches_line(words, found["said"][said]["batches"]) for said, words in SAID),
        "",
        "## Trips",
        "",
        f"{trips['n']} trips with a known load: {trips['told_tkm']:.1f} tonne-kilometres told, "
        f"{trips['true_tkm']:.1f} true; {_share(trips['n_held'], trips['n'])} within their 95 % intervals; the "
        f"distance, by the receiver's speed, {trips['mean_abs_distance_pct']:.1f} % off in the mean.",
        "",
        "What an event is and how its probability is found: "
        "[method](method.md#load-events-and-trips-gatewaycoreevents).",
        "",
    )


def _batches_line(words: str, batches: Mapping[str, Any]) -> str:
    score = score_cell(batches["interval_score_pct"], batches["mean_abs_pct"])
    return (
        f"| {words} | {batches['n']} | {batches['mean_abs_pct']:.1f} % | {batches['bias_pct']:+.1f} % | "
        f"{batches['half_width_pct']:.1f} % | {score} | {_share(batches['n_held'], batches['n'])} |"
    )


def _share(n: int, of: int) -> str:
    return f"{n} of {of} ({n / of:.0%})"
