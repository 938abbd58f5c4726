"""A phone's recording as its app exported it: a zip, or its unpacked folder."""

import zipfile
from pathlib import Path
from typing import Final

from gateway.errors import LogUnreadableError
from gateway.offline.phone.phyphox import read_phyphox
from gateway.offline.phone.sensor_logger import read_sensor_logger
from gateway.offline.phone.tables import PhoneRecording, head_of, is_named

LARGEST_BYTES: Final = 1 << 31  # chosen: of one unpacked CSV, a day at 200 Hz


def read_recording(path: Path) -> PhoneRecording:
    """Read an app's export. Raises LogUnreadableError naming the file, what it lacks, and how to record it."""
    members = _members(path)
    if any(is_named(name, "metadata") for name in members) or any(
        "seconds_elapsed" in head_of(t) for t in members.values()
    ):
        return read_sensor_logger(path, members)
    if any('"Time (s)"' in head_of(text) for text in members.values()):
        return read_phyphox(path, members)
    raise LogUnreadableError(
        f"{path}: is no export of Sensor Logger (CSV) or phyphox (CSV): it has {', '.join(sorted(members)) or 'no CSV'}"
    )


def _members(path: Path) -> dict[str, str]:
    """Text of every CSV by its path in the export."""
    if path.is_dir():
        found = {str(each.relative_to(path)): each.read_bytes() for each in sorted(path.rglob("*.csv"))}
    elif not path.is_file():
        raise LogUnreadableError(f"{path}: no such file")
    else:
        try:
            with zipfile.ZipFile(path) as archive:
                wanted = [each for each in archive.infolist() if each.filename.lower().endswith(".csv")]
                large = next((each for each in wanted if each.file_size > LARGEST_BYTES), None)
                if large is not None:
                    raise LogUnreadableError(
                        f"{path}: {large.filename} has {large.file_size} bytes: no drive is so long"
                    )
                found = {each.filename: archive.read(each) for each in wanted}
        except (zipfile.BadZipFile, OSError, EOFError, NotImplementedError, RuntimeError) as fault:
            raise LogUnreadableError(f"{path}: cannot be unpacked as a zip: {fault}; export it again") from None
    return {name: text.decode("utf-8-sig", errors="replace") for name, text in found.items()}
