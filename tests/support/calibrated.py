"""A made-up calibration file of the ratio index."""

import json
from typing import Any

import numpy as np

from gateway.calibration.file import CalibrationFile, DrivePart, ProvenancePart, SeenPart
from gateway.calibration.statements import Statement
from gateway.core.ratio_index.index import PAPER_BANDS, RatioIndexCalibration
from gateway.core.ratio_index.regression import RegressionModel
from gateway.core.vehicle import Vehicle
from gateway.stated.statement import StatementSource


def constant_model(answer: float, std: float) -> RegressionModel:
    """A regression that answers the same whatever the index: its spread is that of one new observation."""
    return RegressionModel(
        terms=("ra",),
        lows=np.array([0.0]),
        highs=np.array([100.0]),  # no index lies beyond
        coefficients=np.array([answer, 0.0]),
        gram_inverse=np.zeros((2, 2)),
        residual_std=std,
        dof=9.0,
    )


def ratio_index_calibration(payload_kg: float = 200.0, front_share_pct: float = 48.0) -> RatioIndexCalibration:
    """Answers these numbers at 15 m/s."""
    return RatioIndexCalibration(
        spectrum="amplitude",
        n_segment=256,
        acceleration_bands=PAPER_BANDS["acceleration"],
        pitch_rate_bands=PAPER_BANDS["pitch_rate"],
        payload=constant_model(payload_kg, 10.0),
        front_share=constant_model(front_share_pct, 0.5),
        speed_range_mps=(14.0, 16.0),
        speed_std_max_mps=1.0,
    )


def calibration_file(payload_kg: float = 200.0, front_share_pct: float = 48.0) -> CalibrationFile:
    """Loads of 0 to 400 kg and shares of 46 to 50 % were seen."""
    statement = Statement(source=StatementSource.KNOWN, payload_kg=0.0, front_share_pct=50.0)
    drive = DrivePart(number=1, log="a.log", sha256="0" * 64, n_batches=2, statement=statement, found=None)
    return CalibrationFile(
        vehicle=Vehicle(
            name="van",
            empty_mass_kg=1240.0,
            wheelbase_m=2.8,
            sensor_position_m=3.2,
            sensor_offset_left_m=0.0,
            sensor_offset_left_std_m=0.3,
            gross_limit_kg=2000.0,
        ),
        seen=SeenPart(
            payload_kg=(0.0, 400.0),
            front_share_pct=(46.0, 50.0),
            speed_mps=(14.0, 16.0),
            sensor_rate_hz=(100.0, 100.0),
            roughness_mps2=None,
        ),
        ratio_index=ratio_index_calibration(payload_kg, front_share_pct),
        provenance=ProvenancePart(
            software="springscale test",
            command="springscale calibrate",
            campaign_sha256="1" * 64,
            drives=(drive,),
        ),
    )


def calibration_text(file: CalibrationFile | None = None, **vehicle: float | None) -> str:
    """The text of the calibration file, with these figures of the vehicle changed."""
    told: dict[str, Any] = json.loads((file or calibration_file()).to_json())
    told["vehicle"] |= vehicle
    return json.dumps(told)
