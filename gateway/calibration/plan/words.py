"""The plan of loads to drive, in sentences."""

from gateway.calibration.plan.loads import PlacedLoad
from gateway.calibration.plan.plan import Expected, LoadPlan, StatedWidths
from gateway.estimate import Z95
from gateway.words import percent


def plan_sentences(plan: LoadPlan) -> str:
    """The present expectation, the runs to drive in order, and the gain of each."""
    is_enough = plan.is_enough_driven
    what = "most useful would be" if is_enough else "drive next"
    minutes, kmh = plan.drive.duration_s / 60.0, 3.6 * plan.drive.speed_mps
    lines = [
        f"{plan.vehicle}: nothing driven yet; expected from typical road vehicles"
        if plan.now is None
        else f"{plan.vehicle}, {plan.n_driven} runs driven: expected {_expected(plan.now)}",
        *(["enough is driven: no further run would narrow answers by a tenth"] if is_enough else []),
        f"{what}, each for {minutes:.0f} minutes near {kmh:.0f} km/h:",
        *(f"{i}. {load_words(step.load)}: then {_expected(step.expected)}" for i, step in enumerate(plan.advice, 1)),
    ]
    if plan.least is not None:
        lines.append(f"least useful would be: {load_words(plan.least.load)}: then {_expected(plan.least.expected)}")
    if plan.sideways is not None:
        load, left_m = plan.sideways.load, plan.sideways.payload_left_m
        lines.append(
            f"one run with a load to one side: {load_words(load)}, {left_m:g} m left or right of the centre line "
            f"(payload_left_m = {left_m:g} or -{left_m:g}): its effect is then measured instead of derived "
            "from springs and road; so are the signs of the roll rate and of sensor_offset_left_m"
        )
    return "\n".join(lines)


def widths_sentence(widths: StatedWidths) -> str:
    """The cost of not stating what the vehicle carries."""
    kinds = ", ".join(
        f"{one.unsaid.payload_kg:.0f} ± {one.unsaid.half_width_kg:.0f} kg with {kind} "
        f"({one.said.payload_kg:.0f} ± {one.said.half_width_kg:.0f} once said)"
        for kind, one in widths.carries.items()
    )
    return (
        f"The campaign does not say what the vehicle carries. One batch would state a load of {widths.payload_kg:g} "
        f"kg as {kinds}; "
        "± values are 95 % intervals. State it in [vehicle]: carries, or payload_length_m and payload_height_m."
    )


def best_next(plan: LoadPlan) -> str | None:
    """The first advice in a sentence; None if there is none."""
    if not plan.advice:
        return None
    first = plan.advice[0]
    load, now = load_words(first.load), f" (now {_expected(plan.now)})" if plan.now else ""
    after = f"expected {_expected(first.expected)} afterwards{now}."
    if plan.is_enough_driven:
        enough = "Enough is driven: no further run would narrow answers by a tenth."
        return f"{enough} The most useful would be {load}: {after}"
    return f"{load.capitalize()}: {after}"


def load_words(load: PlacedLoad) -> str:
    """The load and its place."""
    if load.position_m is None:
        return "the empty vehicle"
    return f"load {load.payload_kg:g} kg with its centre {load.position_m:g} m behind the front axle"


def _expected(expected: Expected) -> str:
    payload_kg, share_pct = Z95 * expected.payload_std_kg, Z95 * expected.front_share_std_pct
    text = f"± {payload_kg:.0f} kg and ± {share_pct:.1f} percentage points (95 %)"
    if expected.reach_share is None:
        return text
    return f"{text}, {percent(expected.reach_share)} of the loads it may carry within reach"
