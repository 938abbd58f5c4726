"""Writes docs/estimate.md from gateway/estimate_json; with --check only tells whether it is up to date."""

from pathlib import Path
from typing import Final

from generated import keep_up_to_date

from gateway.estimate import PLACES, Lack
from gateway.estimate_json import FIELDS, INSTANT, NUMBERS_BY_NAME, REASONS, SPECTRA, WEIGHTS, EstimateField

PAGE = Path(__file__).with_name("estimate.md")

UNITS: Final = (
    ("_kg", "kg"),
    ("_std_pct", "pp"),
    ("_pct", "%"),
    ("_left_m", "m"),
    ("_left_std_m", "m"),
    ("_left_interval95_m", "m"),
    ("_mps2", "m/s²"),
    ("_mps", "m/s"),
    ("_ns", "ns"),
)
SHARES: Final = ("gap_share", "usable_share", "roll_usable_share", "shares")

NULL: Final = {
    "id": "",
    "vehicle_id": "null where no configuration names the vehicle",
    "vin": "absent unless `[vehicle] vin` says it",
    "t_start_ns": "",
    "t_end_ns": "",
    "estimator": "",
    "calibration_id": "null without a calibration",
    "payload": "null where rejected, or where the ratio index has no model of it",
    "front_share": "null where rejected, or where the ratio index has no model of it",
    "payload_front_share_correlation": "null where rejected",
    "cg_left": "null where rejected, by the ratio index, and without a roll rate",
    "left_share": "as above",
    "payload_cg_left_correlation": "as above",
    "front_share_cg_left_correlation": "as above",
    "roll_share_front": "as above",
    "roll_share_front_std": "as above",
    "weights": "what is unknown in it is null and says what it lacks; see below",
    "ratio_index_acceleration": "null where rejected before it was computed, and without a calibrated ratio index",
    "ratio_index_pitch_rate": "as above",
    "mean_speed_mps": "null where no speed is known",
    "gap_share": "",
    "usable_share": "",
    "roll_usable_share": "null without a roll rate in the signal map, and where nothing is usable",
    "roughness_mps2": "null without spectra or speed",
    "shares": "",
    "rejected": "",
    "is_provisional": "absent in the estimate of a whole batch",
    "spectra": "absent where nothing could be transformed, and where the request says `spectra=false`",
    "diagnostics": "empty where rejected before a fit",
    "epoch": "absent where rejected or provisional; the place is null where no batch told it",
    "way": "null in what early versions stored, and in an early look; what is unknown in it is null",
    "known_weights_id": "absent where no known weight is in use",
    "raw_payload": "absent where no known weight is in use",
    "raw_front_share": "as above",
    "error_budget": "empty where rejected",
    "posterior": "absent where rejected",
    "measured": "absent where no known weight is in use",
}
"""When a field is unknown, by the part of Estimate that it shows. Empty: never."""

DIAGNOSTICS: Final = {
    "reach": "how far the load lies beyond the known ones, in parts of the empty sprung mass; 0 among them",
    "misfit": "likelihood ratio per degree of freedom against free matrices: about 1 where the model fits",
    "n_segments": "segments that were averaged",
    "amplitude_ratio": "how much the vehicle moved, over the usual in calibration",
    "damper_front_ratio": "front dampers' rate over the calibrated",
    "damper_rear_ratio": "rear dampers' rate over the calibrated",
    "delay_scale": "by which share the rear axle came later than wheelbase and speed say",
    "tension": "how far the vehicle lies off its calibration: chi-squared of five; refused above 25.7",
    "sensor_position_score": "pull to another place or gain of the sensor, in standard deviations; refused beyond 6",
    "sensor_noise_score": "pull towards more noise in the acceleration, as roll makes it, likewise; refused above 6",
    "payload_gyration_m2": "squared radius of gyration in pitch of the load, as the fit began with it",
    "payload_mode_hz": "frequency at which the payload rings on its floor",
    "payload_damping_ratio": "how much its floor or mount damps that, of critical",
    "delay_s": "mean time from axle to axle",
    "delay_std_s": "its standard deviation over the segments",
}
"""What cross_spectrum says of its own; the ratio index says nothing."""

LACKS: Final = {
    Lack.CALIBRATION: "nobody says what the vehicle weighs empty: no calibration is in use",
    Lack.ESTIMATE: "the batch was rejected, or the estimator does not tell the front share",
    Lack.UNSPRUNG_MASS: "`[vehicle]` of the campaign states neither the axle's unsprung mass nor its kerb weight, and "
    "the calibration has no part for cross_spectrum, which would have found it",
    Lack.TRACK_WIDTH: "`[vehicle]` of the campaign states no `track_width_m`",
    Lack.ROLL_RATE: "nothing tells where the load lies sideways: no roll rate, or a calibration without one",
}
"""What a weight may lack, in words."""

INTRODUCTION = """\
# An estimate, field by field

Generated from `gateway/estimate_json` by `python docs/make_estimate.py`; do not edit by hand.

Each batch is one JSON object, the same from `springscale estimate --json`, in the store, over [HTTP](api.md) and by
[MQTT](uplink.md). Unknown is null, never 0. Where `rejected` names [reasons](reasons.md), the numbers are null.
"""

KNOWN: Final = ("known_weights_id", "raw_payload", "raw_front_share", "error_budget", "posterior", "measured")
GROUPS: Final = (
    ("The batch", ("",)),
    ("Epoch: all batches of this load together", ("epoch",)),
    ("Known weights, and the error by its sources", KNOWN),
)

ON_THE_ROAD = """\
## Weights on the road

`weights` holds one object for each of {places}.
It has `kg` and `std_kg`, `limit_kg` (null: not stated), `is_over_limit` (this number is above it; warnings with
hysteresis are at `/api/v1/weights/latest`), `is_unsprung_estimated` (calibration found the unsprung mass in it, as
nobody stated one; false where the weight is unknown), and `lacks`: null where the weight is known, else the first thing
that is missing:

| `lacks` | meaning |
|---|---|
{rows}

Limits are those of `[vehicle]` in the [settings](settings.md), one by one; where it states none, the one of the
campaign's [`[vehicle]`](campaign.md#vehicle) that the calibration was made with stands. So a limit is changed without
calibrating: `systemctl restart springscale` puts it in force, `springscale check-config` says which stand.
`springscale estimate --config` and the [archive's manifest](archive.md#the-manifest) take the same keys. A limit is
part of no `id`: a batch weighed again under another limit is the same batch.

Weights are static, of the vehicle on level ground, unsprung masses included. An axle bears its share of the sprung
mass. Its wheels bear half of that each, and the left ones more, the right ones less, by the axle's part of the moment
of the whole about the centre line: `roll_share_front` of it at the front axle, the rest at the rear. Standard
deviations are of first order in payload, front share, `cg_left_m` and `roll_share_front` with the correlations told
above; the vehicle's empty figures count as exact.

What is unsprung is, axle by axle, `unsprung_*_kg` as stated; else what `kerb_*_axle_kg` leaves beside the sprung mass
on the axle; else what the calibration of cross_spectrum found, with its standard deviation. This one joins that of
the weight as independent: payload and share have almost no part of their error in common with it. It is there in
estimates by the ratio index too, where one file holds both.
"""

CSV = """\
## In a CSV file

`/api/v1/export.csv` has one line a batch. An interval becomes two columns, as named above. Reasons are joined by
blanks, and so are the places in `over_limit`. Fields without a column are in the JSON alone.
"""


def estimate_page() -> str:
    """The whole page as Markdown."""
    tables = [f"## {title}\n\n{_table(parts)}" for title, parts in GROUPS]
    return "\n".join([INTRODUCTION, *tables, _weights(), _diagnostics(), CSV])


def part_of(one: EstimateField) -> str:
    """The part of Estimate that a field shows: a key of NULL."""
    return "t_end_ns" if one.name == "t_end" else one.path.partition(".")[0]


def unit_of(one: EstimateField) -> str:
    """The unit in which the field's number is; empty for words and pure numbers."""
    if one.name in SHARES:
        return "0 to 1"
    if one.kind in (INSTANT, REASONS, SPECTRA, NUMBERS_BY_NAME, WEIGHTS):
        return ""
    return next((unit for ending, unit in UNITS if one.name.endswith(ending)), "")


def _table(group: tuple[str, ...]) -> str:
    elsewhere = {part for _, parts in GROUPS for part in parts}
    named = [one for one in FIELDS if (part_of(one) if part_of(one) in elsewhere else "") in group]
    cells = ((one.name, unit_of(one), one.description, NULL[part_of(one)], _columns(one)) for one in named)
    rows = [f"| `{name}` | {' | '.join(map(str, rest))} |" for name, *rest in cells]
    return "| field | unit | meaning | unknown | columns in CSV |\n|---|---|---|---|---|\n" + "\n".join(rows) + "\n"


def _columns(one: EstimateField) -> str:
    return ", ".join(f"`{column}`" for column in one.columns)


def _weights() -> str:
    rows = "\n".join(f"| `{lack}` | {meaning} |" for lack, meaning in LACKS.items())
    return ON_THE_ROAD.format(places=", ".join(f"`{place}`" for place in PLACES), rows=rows)


def _diagnostics() -> str:
    rows = [f"| `{name}` | {meaning} |" for name, meaning in DIAGNOSTICS.items()]
    head = "## diagnostics of cross_spectrum\n\nUnits stand at the end of a name; what has none is a pure number.\n\n"
    return f"{head}| name | meaning |\n|---|---|\n" + "\n".join(rows) + "\n"


def main() -> None:
    """Write the page, or compare it."""
    keep_up_to_date(PAGE, estimate_page(), "gateway/estimate_json")


if __name__ == "__main__":
    main()
