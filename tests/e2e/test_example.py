"""The examples run as they stand."""

import json
import math
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gateway.bus.logs import motion_of_log
from gateway.bus.signals import load_signal_map
from gateway.records import Signal, joined
from gateway.sim.instruments import Mount, Recording, Sensors
from gateway.sim.obstacles import UnevenRoad
from gateway.sim.road import iso_road
from gateway.sim.scenario import simulate_drive
from gateway.sim.speed_profile import rural, urban
from gateway.sim.vans import PAPER_VAN

EXAMPLES = Path(__file__).parents[2] / "examples"
NOTEBOOK = EXAMPLES / "weigh_from_arrays.ipynb"
TURNED_DEG = 130.0  # of the phone about up
TRUTHS_KG = [0.0, 0.0, 0.0, 270.0, 270.0]


@pytest.mark.filterwarnings("ignore:.*FigureCanvasAgg is non-interactive:UserWarning")  # plt.show() without a screen
def test_the_notebook_ends_in_a_table_and_a_plot_of_weights(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pandas")
    pytest.importorskip("matplotlib").use("agg")
    names: dict[str, Any] = {}
    for number, cell in enumerate(json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]):
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), f"{NOTEBOOK.name}, cell {number}", "exec"), names)
    assert capsys.readouterr().out.split()[:2] == ["t_end", "payload_kg"]
    weighed = names["weighed"]
    off = [
        abs(payload_kg - truth_kg) / std_kg
        for payload_kg, std_kg, truth_kg in zip(
            weighed["payload_kg"], weighed["payload_std_kg"], TRUTHS_KG, strict=True
        )
    ]
    assert max(off) < 2.0
    (drawn,) = names["figure"].axes
    assert drawn.get_ylabel() == "payload [kg]"
    assert list(drawn.get_lines()[0].get_ydata()) == list(weighed["payload_kg"])


def exported(recording: Recording, path: Path) -> None:
    """A zip as Sensor Logger writes it, of a phone that lies turned."""
    a = math.radians(TURNED_DEG)
    turn = np.array([[math.cos(a), math.sin(a), 0.0], [-math.sin(a), math.cos(a), 0.0], [0.0, 0.0, 1.0]])
    with zipfile.ZipFile(path, "w") as archive:
        for name, xyz in (("TotalAcceleration", recording.accel_mps2), ("Gyroscope", recording.gyro_radps)):
            rows = zip(recording.imu_t_ns.tolist(), (xyz @ turn.T).tolist(), strict=True)
            lines = [f"{t_ns},{t_ns / 1e9},{z},{y},{x}" for t_ns, (x, y, z) in rows]
            archive.writestr(f"{name}.csv", "\n".join(["time,seconds_elapsed,z,y,x", *lines]))
        fixes = zip(recording.gps_t_ns.tolist(), recording.gps_speed_mps.tolist(), strict=True)
        archive.writestr("Location.csv", "\n".join(["time,speed", *(f"{t_ns},{speed}" for t_ns, speed in fixes)]))


def test_a_phones_recording_becomes_a_log_in_the_vehicles_axes(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    drive = urban(200.0, rng).then(rural(200.0, rng))
    road = UnevenRoad(iso_road("B"), stretch_m=600.0, spread=0.25)
    driven = simulate_drive(PAPER_VAN, (), road, drive, Sensors(mount=Mount(position_m=2.4, height_m=0.5)), 5).recording
    exported(driven, tmp_path / "drive.zip")
    script = [sys.executable, EXAMPLES / "phone.py", tmp_path / "drive.zip", tmp_path / "drive.log"]
    subprocess.run(script, check=True)
    motions, report = motion_of_log(tmp_path / "drive.log", load_signal_map("springscale:reference"))
    motion = joined(list(motions))
    assert report.frames == 2 * len(driven.imu_t_ns) + len(driven.gps_t_ns)
    for signal, truth in (
        (Signal.VERTICAL_ACCELERATION, driven.accel_mps2[:, 2]),
        (Signal.PITCH_RATE, driven.gyro_radps[:, 1]),
        (Signal.ROLL_RATE, driven.gyro_radps[:, 0]),
    ):
        column = motion.columns[:, motion.signals.index(signal)]
        read = column[np.isfinite(column)]
        assert np.corrcoef(read, truth)[0, 1] > 0.99, signal
        assert np.std(read) == pytest.approx(np.std(truth), rel=0.02)
