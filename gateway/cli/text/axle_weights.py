"""A campaign's [vehicle] from axle weights, as TOML to paste."""

from gateway.calibration.axle_weights import UNSPRUNG_SHARE, Sprung


def vehicle_block(sprung: Sprung) -> str:
    """The table with a comment on the source of its figures. The keys that a tape measures are named, not made up."""
    head = [
        "[vehicle]",
        f"# unsprung masses: front {_unsprung(sprung.unsprung_front_kg, sprung.weights.unsprung_front_kg)},",
        f"#                   rear {_unsprung(sprung.unsprung_rear_kg, sprung.weights.unsprung_rear_kg)}",
        f"# standard deviation of empty_mass_kg: {sprung.mass_std_kg:.0f} kg",
    ]
    keys = [f"{name} = {number}" for name, number in sprung.vehicle_keys().items()]
    return "\n".join([*head, *keys, "# still to be given: name, wheelbase_m, sensor_position_m"])


def _unsprung(kg: float, given_kg: float | None) -> str:
    told = "as given" if given_kg is not None else f"estimated, {100.0 * UNSPRUNG_SHARE:.1f} % of the sprung mass"
    return f"{kg:.1f} kg ({told})"
