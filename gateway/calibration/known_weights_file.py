"""known_weights.json: every known weight, the newest last, with its confirmation and its end.

It is beside the database and separate from the calibration file, which no known weight changes. Their effect is
computed from the list (core.known_weights), so that each can be taken back. Only the service writes it, atomically.
"""

import hashlib
import json
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from pydantic import Field, ValidationError, model_validator

from gateway.core.known_weights import Knowledge, Observation
from gateway.errors import ConfigurationError
from gateway.estimate_json import posterior_from_json
from gateway.files.kept import KeptFiles
from gateway.records import ns_of
from gateway.stated.facts import Confirmation, Ending, KnownWeightFields, Part
from gateway.toml_file import describe_faults

FILE_NAME: Final = "known_weights.json"
MOST_KNOWN_WEIGHTS: Final = 200  # chosen: beyond it the oldest withdrawn ones are dropped


def content_id(content: dict[str, Any]) -> str:
    """sha256:... over the canonical JSON of ``content``: keys sorted, no spaces."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return "sha256:" + hashlib.sha256(text.encode()).hexdigest()


class KnownWeight(KnownWeightFields):
    """A known weight with its load as measured, as stored in the file.

    ``id`` is the hash of all but its confirmation and its end.
    """

    posterior: dict[str, Any] = Field(description="the load as measured, before any known weight")

    def content_id(self) -> str:
        """The id that the content should have."""
        return content_id(self.model_dump(mode="json", exclude={"id", "confirmed", "ended"}))

    @property
    def observation(self) -> Observation:
        """The same in the core's terms."""
        truth, std = [self.payload_kg], [self.payload_std_kg]
        if self.front_share_pct is not None and self.front_share_std_pct is not None:
            truth.append(self.front_share_pct)
            std.append(self.front_share_std_pct)
        return Observation(
            id=self.id,
            t_ns=ns_of(self.t_end),
            calibration_id=self.calibration_id,
            estimator=self.estimator,
            posterior=posterior_from_json(self.posterior),
            truth=np.array(truth),
            truth_covariance=np.diag(np.square(std)),
        )

    @property
    def is_held(self) -> bool:
        """True if its estimate contradicts it and nobody confirmed it: it has no effect yet."""
        return self.ended is None and self.confirmed is None and self.is_contradicted

    @property
    def teaches(self) -> bool:
        """Whether estimates use it."""
        return self.ended is None and not self.is_held


class KnownWeights(Part):
    """All stored known weights, oldest first."""

    format: Literal["springscale-known-weights"] = "springscale-known-weights"
    version: Literal[1] = 1
    entries: tuple[KnownWeight, ...] = ()

    def of(self, calibration_id: str | None, estimator: str) -> tuple[KnownWeight, ...]:
        """Those with an effect on this calibration and estimator."""
        wanted = (calibration_id, estimator)
        return tuple(one for one in self.entries if (one.calibration_id, one.estimator) == wanted and one.teaches)

    def knowledge(self, calibration_id: str | None, estimator: str) -> Knowledge | None:
        """Their joint knowledge; None without any."""
        return Knowledge.of([one.observation for one in self.of(calibration_id, estimator)])

    def as_of(self, t_ns: int) -> "KnownWeights":
        """The list at an earlier time, without later entries, confirmations and ends."""

        def then(moment: Confirmation | Ending | None) -> bool:
            return moment is not None and ns_of(moment.at) < t_ns

        entries = tuple(
            one.model_copy(
                update={
                    "confirmed": one.confirmed if then(one.confirmed) else None,
                    "ended": one.ended if then(one.ended) else None,
                }
            )
            for one in self.entries
            if ns_of(one.at) < t_ns
        )
        return self.model_copy(update={"entries": entries})

    @model_validator(mode="after")
    def _is_unchanged(self) -> "KnownWeights":
        changed = [entry.id for entry in self.entries if entry.id != entry.content_id()]
        if changed:
            raise ValueError(f"known weight {changed[0]} was changed after it was written")
        return self

    def with_entry(self, entry: KnownWeight) -> "KnownWeights":
        """The list with one more entry; entries in force are never dropped."""
        ended = [one.id for one in self.entries if one.ended is not None]
        forgotten = set(ended[: max(0, len(self.entries) + 1 - MOST_KNOWN_WEIGHTS)])
        kept = tuple(one for one in self.entries if one.id not in forgotten)
        return self.model_copy(update={"entries": (*kept, entry)})

    def changed(self, entry_id: str, **update: Any) -> "KnownWeights":
        """With one entry confirmed or ended."""
        entries = tuple(one.model_copy(update=update) if one.id == entry_id else one for one in self.entries)
        return self.model_copy(update={"entries": entries})


def load_known_weights(path: Path) -> KnownWeights:
    """The file's entries, none without a file. Raises ConfigurationError for an invalid file."""
    try:
        return known_weights_of(KeptFiles(path.parent).read(path.name), path)
    except FileNotFoundError:
        return KnownWeights()
    except OSError as fault:
        raise ConfigurationError(f"{path}: cannot be read: {fault.strerror or fault}") from None


def known_weights_of(content: bytes, path: Path | str) -> KnownWeights:
    """The content of such a file. Raises ConfigurationError, naming ``path``, if it is invalid."""
    try:
        return KnownWeights.model_validate_json(content)
    except ValidationError as fault:
        raise ConfigurationError(
            f"{describe_faults(path, fault, KnownWeights)}: restore it, or remove it to go on without known weights"
        ) from None
