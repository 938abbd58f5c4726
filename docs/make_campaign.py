"""Writes docs/campaign.md from gateway/calibration/campaign.py; with --check only tells whether it is up to date."""

from pathlib import Path

from generated import keep_up_to_date, key_table

from gateway.calibration.axle_weights import DIVISION_KG, AxleWeights, sprung_of
from gateway.calibration.campaign import CampaignTable, RunTable
from gateway.calibration.half_car.prior import ESTIMATED_UNSPRUNG_STD, UNSPRUNG_SHARE, WEIGHED_STD
from gateway.cli.text.axle_weights import vehicle_block
from gateway.core.vehicle import Vehicle

PAGE = Path(__file__).with_name("campaign.md")
WEIGHED = AxleWeights(front_kg=760.0, rear_kg=640.0)
MEASURED = {"Ford Escort": (75.0, 4.5, 4.5), "VW Vanagon": (90.21635, 5.56015, 5.56015)}  # sprung, unsprung, in slugs
GOLDEN_CAR: float = 0.15  # unsprung over sprung mass of a quarter-car, both axles together

INTRODUCTION = """\
# The campaign file

Generated from `gateway/calibration/campaign.py` by `python docs/make_campaign.py`; do not edit by hand.

It tells `springscale calibrate` which drives with known loads were recorded, and with which vehicle. Paths are
relative to the file. An unknown key, a limit that is broken or a log that is not there is an error that names the key.
[Calibration](calibration.md) says what to drive; axes and names are in the [nomenclature](nomenclature.md).

```toml
signals = "signals.toml"              # or springscale:NAME, a map that comes with the package
identification_fraction = 0.667

[vehicle]
name = "van"
empty_mass_kg = 1240.0                # sprung mass: see "From axle weights" below
empty_front_share_pct = 50.0
wheelbase_m = 2.8
track_width_m = 1.5
sensor_position_m = 3.1
sensor_offset_left_m = -0.25          # 25 cm right of the centre line

[[runs]]
log = "01_empty.log.gz"
payload_kg = 0.0

[[runs]]
log = "02_boxes.log.gz"
payload_kg = 270.0
payload_position_m = 0.5              # behind the front axle
payload_left_m = 0.3                  # left of the centre line
start_s = 30.0                        # only a piece of the log
end_s = 930.0

[[runs]]
log = "03_boxes_behind.log.gz"
payload_kg = 270.0
front_share_pct = 46.0                # instead of the position
split = "validation"                  # takes no part in the fit
```
"""

RANGES = """\
`payload_range_kg` and `front_share_range_pct` are what errors are stated in percent of (equation (12) of the paper) and
what plans and the error over all loads keep within. No estimate is clipped to them. Limits on weights are for warnings
(`/api/v1/weights/latest`) and for plans. A weight on the road needs unsprung masses or kerb axle weights. Where
neither is stated it takes the unsprung masses that the calibration of `cross_spectrum` found, is less sure by their
standard deviation, and [says so](estimate.md#weights-on-the-road). Without such a calibration it is null. Plans check
limits by stated figures alone.

**To the side.** The centre line runs midway between left and right tyres; left is the driver's left. Measure the sensor
with a tape, from a side wall or sill, and take half of the vehicle's width there. A sensor off the centre line feels
roll as heave, so a place that is not known makes intervals wider. Scales under single wheels of the empty vehicle give
`empty_cg_left_m`, with w the track width and the two sums over the wheels of a side:

$$y_0 = \\frac{w}{2} \\cdot \\frac{F_{left} - F_{right}}{F_{left} + F_{right}}$$
"""

RUN_RULES = """\
A loaded run needs `payload_position_m` or `front_share_pct`, never both. A load that would lift an axle is refused.
So is one so far to the side that it would lift the wheels of the other, where the track width is given.
Batches begin anew at the cut between identification and validation; with `identification_fraction = 1.0` nothing is
left to validate.
"""


def campaign_page() -> str:
    """The whole page as Markdown."""
    return "\n".join(
        [
            INTRODUCTION,
            f"## Top of the file\n\n{key_table(CampaignTable, 'vehicle', 'runs')}",
            f"## [vehicle]\n\nMasses and shares are of the sprung mass.\n\n{key_table(Vehicle)}\n{RANGES}",
            f"## [[runs]]: one drive with a known load\n\n{key_table(RunTable)}\n{RUN_RULES}",
            _from_axle_weights(),
        ]
    )


def _from_axle_weights() -> str:
    body = sprung_of(WEIGHED)
    estimated_pct, given_pct = 100.0 * ESTIMATED_UNSPRUNG_STD, 100.0 * WEIGHED_STD
    shares = {car: 100.0 * (front + rear) / 2.0 / sprung for car, (sprung, front, rear) in MEASURED.items()}
    cars = " and ".join(f"{pct:.1f} % ({car})" for car, pct in shares.items())
    return f"""\
## From axle weights to sprung mass and front share

A weighbridge shows F under the front axle and R under the rear one. Weigh the empty vehicle on level ground, with
driver and tank as in service. The body rests on the front axle with its share s. Wheels, brakes and axles (u) are not
carried by the springs. Each axle is in static equilibrium:

$$F = s M + u_f \\qquad R = (1 - s) M + u_r$$

The sum gives the sprung mass, the first line its front share:

$$M = F + R - u_f - u_r \\qquad s = \\frac{{F - u_f}}{{M}}$$

| symbol | key | meaning |
|---|---|---|
| $F$, $R$ | `kerb_front_axle_kg`, `kerb_rear_axle_kg` | what the scales show, kg |
| $u_f$, $u_r$ | `unsprung_front_kg`, `unsprung_rear_kg` | unsprung masses, kg |
| $M$ | `empty_mass_kg` | sprung mass of the empty vehicle, kg |
| $s$ | `empty_front_share_pct` | its share on the front axle, in percent in the file |

The command does it, and prints a block to paste (`--json` for programs):

```console
$ springscale calibration sprung --front-axle-kg {WEIGHED.front_kg:g} --rear-axle-kg {WEIGHED.rear_kg:g}
{vehicle_block(body)}
```

**Where the unsprung masses are unknown** (no `--unsprung-front-kg`, `--unsprung-rear-kg`), each is taken as
k = {100 * UNSPRUNG_SHARE:.1f} % of the sprung mass, so with both unknown

$$M = \\frac{{F + R}}{{1 + 2 k}}$$

The same share is the centre of calibration's prior, and an estimate is left out of the block, so that calibration goes
on treating it as one. Sources:

- the paper's van has 160 kg beside 1240 kg (Table 1, read as four times 40 kg), {100 * 80 / 1240:.1f} % an axle;
- published parameters of two real vehicles have {cars}
  (CommonRoad vehicle models, from vehicle dynamics studies of the US Department of Transportation);
- the quarter-car of the roughness index has {100 * GOLDEN_CAR:.0f} % for both axles, {100 * GOLDEN_CAR / 2:.1f} % each
  (M. W. Sayers, S. M. Karamihas, The Little Book of Profiling, 1998).

**How sure that is.** The standard deviation of an unsprung mass is taken as {estimated_pct:.0f} % where it is estimated
and {given_pct:.0f} % where it is given: beam axles and twin tyres weigh more than these sources say. A reading rounded
to steps of {DIVISION_KG:g} kg (`--division-kg`) adds {DIVISION_KG:g}/√12 = {DIVISION_KG / 12**0.5:.1f} kg. Taken as
independent, to first order:

$$\\sigma_M^2 = \\sigma_f^2 + \\sigma_r^2$$

$$\\sigma_s^2 = \\frac{{(1 - s)^2 \\sigma_f^2 + s^2 \\sigma_r^2}}{{M^2}}$$

with $\\sigma_f$ of $F - u_f$ and $\\sigma_r$ of $R - u_r$. In the example that is {body.mass_std_kg:.0f} kg and
{body.front_share_std_pct:.2f} percentage points.
"""


def main() -> None:
    """Write the page, or compare it."""
    keep_up_to_date(PAGE, campaign_page(), "gateway/calibration/campaign.py")


if __name__ == "__main__":
    main()
