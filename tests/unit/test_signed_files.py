"""What ssh-keygen signs is believed, all else is refused in words that say how to mend it."""

import shutil
import subprocess
from pathlib import Path

import pytest
from click.testing import Result
from support.calibrated import calibration_file
from support.commands import called
from support.configured import service_config
from support.signing import Signer

from gateway.config import load_settings
from gateway.errors import CalibrationFileError, ConfigurationError, SignalMapError, UntrustedFileError
from gateway.files.signed import PublicKey, Trust, load_public_keys, signature_path
from gateway.service.calibration_in_use import keep_copy, setup_or_last_good
from gateway.setup import setup_of

# All by OpenSSH 9.2: `ssh-keygen -t ed25519`, then `printf 'weights\n' > a` and `ssh-keygen -Y sign -n NAMESPACE a`
SIGNED = b"weights\n"
PUBLIC = "ssh-ed25519 AAAAC3NzaC1lZDI1NTE5AAAAICgBLm2Bnwq6tEzp/ml53kINzfyFRMBUSVu6SuKwlQ8X fleet"
FINGERPRINT = "SHA256:Up9hvXivtJBkK95KN3YUi8IBt7VGBxgwHj4bJdxqd+I"  # ssh-keygen -l
BY_SHA512 = """\
-----BEGIN SSH SIGNATURE-----
U1NIU0lHAAAAAQAAADMAAAALc3NoLWVkMjU1MTkAAAAgKAEubYGfCrq0TOn+aXneQg3N/I
VEwFRJW7pK4rCVDxcAAAALc3ByaW5nc2NhbGUAAAAAAAAABnNoYTUxMgAAAFMAAAALc3No
LWVkMjU1MTkAAABA/9Nslo2X5R+TKR0e5oni+VSuCsUwTCjhz2HXYnGf5WczCRIlAH4BHS
YEgXQKHyGbENKiPh2NCI9kNf8DPlAEDQ==
-----END SSH SIGNATURE-----
"""
BY_SHA256 = """\
-----BEGIN SSH SIGNATURE-----
U1NIU0lHAAAAAQAAADMAAAALc3NoLWVkMjU1MTkAAAAgKAEubYGfCrq0TOn+aXneQg3N/I
VEwFRJW7pK4rCVDxcAAAALc3ByaW5nc2NhbGUAAAAAAAAABnNoYTI1NgAAAFMAAAALc3No
LWVkMjU1MTkAAABAZHxMJWRfnaKICdl8iWkKZosUfAQSMPNuWQWLGPbd7p7qSYo8EEeduI
UlRiK44Ue4uKV/tHVWJmKYjdhC2ZPXDQ==
-----END SSH SIGNATURE-----
"""
FOR_THE_NAMESPACE_FILE = """\
-----BEGIN SSH SIGNATURE-----
U1NIU0lHAAAAAQAAADMAAAALc3NoLWVkMjU1MTkAAAAgKAEubYGfCrq0TOn+aXneQg3N/I
VEwFRJW7pK4rCVDxcAAAAEZmlsZQAAAAAAAAAGc2hhNTEyAAAAUwAAAAtzc2gtZWQyNTUx
OQAAAEAvzffhuB0/5Rttd2WO/zUnpUnqY90/xDptsXLrac5vt1TUuhLq36PnrQ6pfUS86W
uhyU+16uIu7r0tqRPjxuoO
-----END SSH SIGNATURE-----
"""
GARAGE, STRANGER = Signer("garage"), Signer("stranger")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "a"
    path.write_bytes(SIGNED)
    return path


@pytest.mark.parametrize("signature", [BY_SHA512, BY_SHA256])
def test_what_ssh_keygen_signed_is_believed(signature: str, file: Path) -> None:
    signature_path(file).write_text(signature)
    key = PublicKey.of(PUBLIC)
    assert key.fingerprint == FINGERPRINT
    assert Trust((GARAGE.public, key)).read(file) == SIGNED


@pytest.mark.skipif(shutil.which("ssh-keygen") is None, reason="ssh-keygen is not installed (openssh-client)")
@pytest.mark.parametrize("hash_name", ["sha512", "sha256"])
def test_this_machine_s_ssh_keygen_signs_as_the_page_says(hash_name: str, file: Path) -> None:
    key = file.parent / "KEY"
    subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", key], check=True)
    sign = ["ssh-keygen", "-q", "-Y", "sign", "-n", "springscale", "-O", f"hashalg={hash_name}", "-f", key, file]
    subprocess.run(sign, check=True, capture_output=True)
    public = PublicKey.of(load_public_keys(key.with_suffix(".pub"))[0])
    assert Trust((public,)).read(file) == SIGNED


@pytest.mark.skipif(shutil.which("ssh-keygen") is None, reason="ssh-keygen is not installed (openssh-client)")
def test_ssh_keygen_believes_the_signatures_of_these_tests(file: Path) -> None:
    GARAGE.sign(file)
    signers = file.parent / "signers"
    signers.write_text(f"garage {GARAGE.public_line}\n")
    verify = ["ssh-keygen", "-Y", "verify", "-f", signers, "-I", "garage", "-n", "springscale"]
    subprocess.run([*verify, "-s", signature_path(file)], input=SIGNED, check=True, capture_output=True)


def test_without_a_key_nothing_need_be_signed(file: Path) -> None:
    assert Trust().read(file) == SIGNED


@pytest.mark.parametrize(
    ("signature", "words"),
    [
        (None, "not signed, there is no a.sig; sign it where the key is"),
        ("", "its .sig is no signature of an ed25519 key for the namespace springscale"),
        ("\xff" * 300, "its .sig is no signature"),
        (FOR_THE_NAMESPACE_FILE, "its .sig is no signature"),
        (BY_SHA512.replace("\n", "\r\n"), "its .sig is no signature"),
        (BY_SHA512 + "\n", "its .sig is no signature"),
        (BY_SHA512 + BY_SHA256, "its .sig is no signature"),
        (STRANGER.signature_of(SIGNED), f"signed by {STRANGER.public.fingerprint}, trusted is {FINGERPRINT} alone"),
        (BY_SHA256.replace("AZHxM", "AZHxN"), "changed after it was signed; restore it, or sign it anew"),
    ],
)
def test_any_other_is_refused_with_what_to_do(signature: str | None, words: str, file: Path) -> None:
    if signature is not None:
        signature_path(file).write_text(signature, encoding="latin-1")
    with pytest.raises(UntrustedFileError) as caught:
        Trust((PublicKey.of(PUBLIC),)).read(file)
    assert str(caught.value).startswith(f"{file}: {words}")
    assert str(caught.value).endswith(": ssh-keygen -Y sign -n springscale -f KEY a")


@pytest.mark.parametrize(
    "line",
    [
        "",
        "ssh-ed25519",
        "ssh-ed25519 AAAA",
        "ssh-ed25519 \ud83d",
        PUBLIC.partition(" ")[2],
        PUBLIC.replace("ssh-ed25519", "ssh-rsa"),
        PUBLIC.replace("8X fleet", "8XAA"),
        "-----BEGIN OPENSSH PRIVATE KEY-----",
    ],
)
def test_what_is_no_public_key_is_refused(line: str) -> None:
    with pytest.raises(ValueError, match=r"not a public key; wanted is the one line of KEY\.pub"):
        PublicKey.of(line)


def test_a_file_of_keys_may_have_remarks_and_must_have_keys(tmp_path: Path) -> None:
    path = tmp_path / "trusted.pub"
    path.write_text(f"# the fleet's\n\n{PUBLIC}\n{GARAGE.public_line}\n")
    assert load_public_keys(path) == (PUBLIC, GARAGE.public_line)
    for text, words in (("# none yet\n", "holds no public key"), (f"{PUBLIC}\nx\n", r"trusted\.pub, line 2: not a")):
        path.write_text(text)
        with pytest.raises(ConfigurationError, match=words):
            load_public_keys(path)
    with pytest.raises(ConfigurationError, match=r"gone\.pub: cannot be read"):
        load_public_keys(tmp_path / "gone.pub")


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """A configuration with files of its own, all of which the garage has signed."""
    dbc = Path(__file__).parents[2] / "dbc"
    shutil.copy(dbc / "springscale_reference.dbc", tmp_path)
    shutil.copy(dbc / "reference.toml", tmp_path / "map.toml")
    trust = f'[trust]\npublic_keys = ["{GARAGE.public_line}"]'
    path = service_config(tmp_path, calibration_file().to_json(), trust, signals="map.toml", estimator="ratio_index")
    GARAGE.sign(path, *deciding(tmp_path))
    return path


def deciding(folder: Path) -> tuple[Path, ...]:
    return folder / "vehicle.json", folder / "map.toml", folder / "springscale_reference.dbc"


def checked(config: Path, *options: str) -> Result:
    return called("check-config", config, *options)


def test_check_config_says_who_signed(config: Path) -> None:
    found = checked(config)
    assert found.exit_code == 0
    assert f"signed as required, by {GARAGE.public.fingerprint}." in found.output


def test_check_config_names_every_file_that_nobody_trusted_has_signed(config: Path) -> None:
    calibration, signals, database = deciding(config.parent)
    signature_path(calibration).unlink()
    STRANGER.sign(signals)
    database.write_bytes(database.read_bytes() + b"\n")
    lines = str(checked(config).exception).splitlines()
    assert [line.partition(": ")[0] for line in lines] == [str(calibration), str(signals), str(database)]
    for line, words in zip(lines, ("not signed", f"signed by {STRANGER.public.fingerprint}", "changed"), strict=True):
        assert line.partition(": ")[2].startswith(words)


@pytest.mark.parametrize(("which", "error"), [(0, CalibrationFileError), (1, SignalMapError), (2, SignalMapError)])
def test_a_changed_file_is_refused_by_who_reads_it(which: int, error: type[Exception], config: Path) -> None:
    path = deciding(config.parent)[which]
    path.write_bytes(path.read_bytes() + b"\n")  # means the same, and yet is not what was signed
    with pytest.raises(error, match="changed after it was signed"):
        setup_of(load_settings(config))


def test_a_shipped_map_needs_no_signature(config: Path) -> None:
    config.write_text(config.read_text().replace('"map.toml"', '"springscale:reference"'))
    assert setup_of(load_settings(config)).signal_map.signals


def test_a_key_pinned_elsewhere_must_have_signed_the_settings_too(config: Path, tmp_path: Path) -> None:
    """And counts for the files they name: settings that pin no key cannot be slipped in."""
    trusted = tmp_path / "trusted.pub"
    trusted.write_text(GARAGE.public_line)
    config.write_text(config.read_text().partition("[trust]")[0])
    with pytest.raises(ConfigurationError, match=r"springscale\.toml: changed after it was signed"):
        load_settings(config, trusted)
    GARAGE.sign(config)
    settings = load_settings(config, trusted)
    assert settings.trust.public_keys == (GARAGE.public_line,)
    assert setup_of(settings).calibration is not None
    STRANGER.sign(tmp_path / "vehicle.json")
    with pytest.raises(CalibrationFileError, match="signed by"):
        setup_of(settings)
    assert checked(config, "--trusted-keys", str(trusted)).exception is not None


def test_keys_in_the_environment_stand_instead_of_the_file_s(config: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SPRINGSCALE_TRUST__PUBLIC_KEYS", f'["{STRANGER.public_line}"]')
    with pytest.raises(CalibrationFileError, match=f"trusted is {STRANGER.public.fingerprint[:20]}"):
        setup_of(load_settings(config))


def test_a_key_that_is_none_is_named(config: Path) -> None:
    config.write_text(config.read_text().replace("ssh-ed25519", "ssh-rsa"))
    with pytest.raises(ConfigurationError, match=r"springscale\.toml: trust\.public_keys\[1\]: not a public key"):
        load_settings(config)


def test_a_start_with_an_unsigned_calibration_takes_the_last_good_signed_copy(config: Path) -> None:
    settings = load_settings(config)
    good = setup_of(settings).calibration
    keep_copy(settings, good)
    other = calibration_file(payload_kg=12.0)
    (config.parent / "vehicle.json").write_text(other.to_json())
    setup, fault = setup_or_last_good(settings)
    assert setup.calibration.id == good.id
    assert "vehicle.json: changed after it was signed" in str(fault)
    assert "last good copy" in str(fault)


def test_a_copy_whose_signer_is_trusted_no_more_is_none(config: Path) -> None:
    """A key taken out of springscale.toml takes what it signed with it."""
    settings = load_settings(config)
    keep_copy(settings, calibration_file())
    config.write_text(config.read_text().replace(GARAGE.public_line, STRANGER.public_line))
    with pytest.raises(CalibrationFileError, match="signed by"):
        setup_or_last_good(load_settings(config))


def test_a_copy_that_was_changed_is_none(config: Path) -> None:
    """The service's own folder is no way round the signature."""
    settings = load_settings(config)
    keep_copy(settings, calibration_file())
    (copy,) = (config.parent / "state").glob("calibration-*.json")
    copy.write_text(calibration_file(payload_kg=12.0).to_json())
    (config.parent / "vehicle.json").unlink()
    with pytest.raises(CalibrationFileError, match=r"vehicle\.json: no such calibration file"):
        setup_or_last_good(settings)
