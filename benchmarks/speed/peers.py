"""Other libraries on the same candump log: the time to extract our three messages into arrays or values.

They are the dependency group ``bench``; missing ones are skipped with a message.
"""

import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.speed.meter import ROOT, best_of

OURS = (0x120, 0x121, 0x130)  # identifiers of the reference map


def wc(log: Path) -> dict[str, Any]:
    """The lower bound: looking at every line."""
    return best_of(
        5, lambda: {"frames": int(subprocess.run(["wc", "-l", log], check=True, capture_output=True).stdout.split()[0])}
    )


def python_lines(log: Path) -> dict[str, Any]:
    """Every line as a Python object, and nothing done with it."""

    def run() -> dict[str, Any]:
        with log.open("rb") as file:
            return {"frames": sum(1 for _ in file)}

    return best_of(2, run)


def python_can_cantools(log: Path) -> dict[str, Any]:
    """python-can's reader, mapped frames decoded by cantools."""
    import can  # noqa: PLC0415 # so that each path pays for its own imports alone
    import cantools  # noqa: PLC0415

    database: Any = cantools.database.load_file(_database())
    messages = {message.frame_id: message for message in database.messages}

    def run() -> dict[str, Any]:
        columns = []
        n_frames = 0
        with can.LogReader(log) as reader:
            for frame in reader:
                n_frames += 1
                if not frame.is_extended_id and (message := messages.get(frame.arbitration_id)) is not None:
                    columns.append((frame.timestamp, message.decode(frame.data, decode_choices=False)))
        return {"frames": n_frames, "samples": len(columns)}

    return best_of(1, run)


def can_decoder_path(log: Path) -> dict[str, Any]:
    """python-can's reader, the mapped frames decoded as one table by can_decoder."""
    import can  # noqa: PLC0415
    import can_decoder  # noqa: PLC0415
    import pandas as pd  # noqa: PLC0415

    decoder = can_decoder.DataFrameDecoder(can_decoder.load_dbc(str(_database())))

    def run() -> dict[str, Any]:
        rows = []
        n_frames = 0
        with can.LogReader(log) as reader:
            for frame in reader:
                n_frames += 1
                if frame.arbitration_id in OURS:
                    rows.append((frame.timestamp, frame.arbitration_id, frame.is_extended_id, list(frame.data)))
        table = pd.DataFrame(rows, columns=["TimeStamp", "ID", "IDE", "DataBytes"])
        table.index = pd.to_datetime(table.pop("TimeStamp"), unit="s", utc=True)
        return {"frames": n_frames, "samples": len(rows), "signals": len(decoder.decode_frame(table))}

    return best_of(1, run)


def hilspy_path(log: Path) -> dict[str, Any]:
    """hilspy, its Rust core decoding by the DBC."""
    import hilspy  # noqa: PLC0415

    def run() -> dict[str, Any]:
        n_frames = n_samples = 0
        with hilspy.open(f"file://{log}?format=candump", f"dbc:{_database()}") as channel:
            for message in channel:
                n_frames += 1
                n_samples += bool(message.fields)
        return {"frames": n_frames, "samples": n_samples}

    return best_of(2, run)


def asammdf_path(log: Path) -> dict[str, Any]:
    """asammdf's extraction by the DBC, from an .mf4 of the same frames."""
    from asammdf import MDF  # noqa: PLC0415

    def run() -> dict[str, Any]:
        with MDF(log.with_suffix(".mf4")) as mdf:
            n_frames = sum(group.channel_group.cycles_nr for group in mdf.groups)
            found = mdf.extract_bus_logging({"CAN": [(_database(), 0)]})
            return {"frames": n_frames, "samples": sum(group.channel_group.cycles_nr for group in found.groups)}

    return best_of(2, run)


def polars_path(log: Path) -> dict[str, Any]:
    """polars' text parser on one thread, payloads as bytes; converting them to bit vectors would cost extra."""
    import numpy as np  # noqa: PLC0415
    import polars as pl  # noqa: PLC0415

    names = [f"{can_id:03X}" for can_id in OURS]
    second, fraction = pl.col("time").str.slice(1, 10).cast(pl.Int64), pl.col("time").str.slice(12, 6).cast(pl.Int64)

    def run() -> dict[str, Any]:
        lines = pl.scan_csv(log, has_header=False, separator=" ", new_columns=["time", "bus", "frame"], quote_char=None)
        parts = pl.col("frame").str.split_exact("#", 1).struct.rename_fields(["id", "payload"])
        ours = lines.with_columns(parts.alias("parts")).unnest("parts").filter(pl.col("id").is_in(names))
        columns = ours.select(
            (second * 1_000_000_000 + fraction * 1000).alias("t_ns"), "id", pl.col("payload").str.decode("hex")
        )
        table = columns.collect()
        n_samples = 0
        for name in names:
            rows = table.filter(pl.col("id") == name)
            payload = np.frombuffer(b"".join(rows["payload"].to_list()), np.uint8).reshape(len(rows), -1)
            n_samples += len(payload)
        return {"frames": lines.select(pl.len()).collect().item(), "samples": n_samples}

    return best_of(3, run)


def _database() -> Path:
    return ROOT / "dbc/springscale_reference.dbc"


PEERS: dict[str, Callable[[Path], dict[str, Any]]] = {
    "wc -l": wc,
    "for line in file": python_lines,
    "polars, text": polars_path,
    "hilspy, by DBC": hilspy_path,
    "asammdf, from .mf4": asammdf_path,
    "can_decoder": can_decoder_path,
    "python-can + cantools": python_can_cantools,
}
SLOW = ("asammdf, from .mf4", "can_decoder", "python-can + cantools")  # a shorter log is enough for these


def read_by(name: str, log: str) -> dict[str, Any]:
    """One of them on a log."""
    return PEERS[name](Path(log))
