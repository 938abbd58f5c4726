"""One light and one sentence on the weight of a vehicle, the same on every page.

    verdict = verdict_of(weights, is_calibrated=True, is_weighed=True, is_doubted=False, is_vague=False)

An alarm of overload needs more evidence than the light, both to begin and to end. Where an early value after unloading
is below a limit of which the alarm is still active, the light is amber and the sentence says why: no page shows green
and red at once.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from gateway.core.weights.limits import LOADED_PLACES, Light, nearness
from gateway.estimates.batch_estimate import Weights


class Says(StrEnum):
    """The sentence beside the light."""

    GO = "go"
    NEAR = "near"
    OVER = "over"
    UNEVEN = "uneven"  # a wheel bears too much, but neither an axle nor the whole vehicle: moving the load helps
    WAS_OVER = "was_over"  # the last full batch was too heavy, the first value since is not
    DOUBTED = "doubted"
    VAGUE = "vague"  # no limit is near, but the weight is not exact enough to say so: the vehicle still learns
    NO_LIMIT = "no_limit"
    WEIGHT_UNKNOWN = "weight_unknown"  # a limit is known, but not the weight
    NOT_CALIBRATED = "not_calibrated"
    READY = "ready"  # calibrated, and not weighed yet


@dataclass(frozen=True, slots=True)
class Verdict:
    """The light, its sentence, the places that they are about, and the probability of the most probable overload (0 to
    1; None: unknown).
    """

    light: Light
    says: Says
    about: tuple[str, ...] = ()
    over_limit_probability: float | None = None


_SAYS: Final = {Light.GO: Says.GO, Light.NEAR: Says.NEAR}


def verdict_of(
    weights: Weights,
    *,
    is_calibrated: bool,
    is_weighed: bool,
    is_doubted: bool,
    is_vague: bool,
    alarmed: tuple[str, ...] = (),
) -> Verdict:
    """The verdict on ``weights``; ``alarmed`` are the places of active overload alarms.

    A doubt about the last weighing takes back everything but an overload. A weighing that is ``is_vague`` (not exact
    enough to be of use) says nothing good: a warning needs no accuracy, an all-clear does.
    """
    near = nearness(weights)
    probability = max(near.probabilities.values(), default=None)
    if near.light is Light.OVER:
        is_uneven = not set(LOADED_PLACES).intersection(near.places())
        return Verdict(Light.OVER, Says.UNEVEN if is_uneven else Says.OVER, near.places(), probability)
    if not is_weighed:
        return Verdict(Light.UNKNOWN, Says.READY if is_calibrated else Says.NOT_CALIBRATED)
    if is_doubted:
        return Verdict(Light.UNKNOWN, Says.DOUBTED, (), probability)
    if near.light is Light.UNKNOWN:
        has_limit = any(weight.limit_kg is not None for _, weight in weights.items())
        return Verdict(Light.UNKNOWN, Says.WEIGHT_UNKNOWN if has_limit else Says.NO_LIMIT)
    if alarmed:
        return Verdict(Light.NEAR, Says.WAS_OVER, alarmed, probability)
    is_unsaid = is_vague and near.light is Light.GO
    light, says = (Light.UNKNOWN, Says.VAGUE) if is_unsaid else (near.light, _SAYS[near.light])
    return Verdict(light, says, near.places(), probability)
