"""Whatever bit is flipped, in the file or in its signature: refused in words, and nothing else happens."""

import random
from pathlib import Path

import pytest
from support.calibrated import calibration_file
from support.signing import Signer

from gateway.calibration.file.calibration_file import load_calibration
from gateway.errors import CalibrationFileError, UntrustedFileError
from gateway.files.signed import Trust, signature_path

N_TRIALS = 500
GARAGE = Signer("garage")
TRUST = Trust((GARAGE.public,))


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "vehicle.json"
    path.write_text(calibration_file().to_json())
    GARAGE.sign(path)
    return path


def flipped(content: bytes, bit: int) -> bytes:
    changed = bytearray(content)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def test_a_flipped_bit_of_the_file_is_refused(file: Path) -> None:
    good, dice = file.read_bytes(), random.Random(14)
    for _ in range(N_TRIALS):
        file.write_bytes(flipped(good, dice.randrange(8 * len(good))))
        with pytest.raises(CalibrationFileError, match="changed after it was signed"):
            load_calibration(file, TRUST.read)
    file.write_bytes(good)
    assert load_calibration(file, TRUST.read).id == calibration_file().id


def test_any_flipped_bit_of_the_signature_is_refused(file: Path) -> None:
    """Every one of them: base64 has bits that mean nothing, and those count too."""
    beside = signature_path(file)
    good = beside.read_bytes()
    assert 8 * len(good) > N_TRIALS
    for bit in range(8 * len(good)):
        beside.write_bytes(flipped(good, bit))
        with pytest.raises(UntrustedFileError):
            TRUST.read(file)


def test_a_signature_cut_lengthened_or_mixed_with_another_is_refused(file: Path) -> None:
    beside, dice = signature_path(file), random.Random(15)
    good, other = beside.read_bytes(), GARAGE.signature_of(b"another file").encode()
    for _ in range(N_TRIALS):
        one, two = sorted(dice.sample(range(len(good) + 1), 2))
        broken = dice.choice(
            (good[:one], good[:one] + good[two:], good[:two] + good[one:], good[:one] + dice.randbytes(9) + good[one:])
        )
        beside.write_bytes(broken)
        with pytest.raises(UntrustedFileError):
            TRUST.read(file)
    for at in range(len(good)):
        spliced = good[:at] + other[at:]
        if spliced != good:
            beside.write_bytes(spliced)
            with pytest.raises(UntrustedFileError):
                TRUST.read(file)
