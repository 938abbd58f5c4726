"""A Debian package holds machine code of its own processor only."""

from pathlib import Path

import pytest
from machine_code import ELF_MAGIC, PROCESSORS, ForeignCodeError, require_own_code, wheel_options
from packaging.tags import Tag
from packaging.utils import parse_wheel_filename


def elf(architecture: str) -> bytes:
    """The head of an ELF file."""
    return ELF_MAGIC.ljust(18, b"\0") + PROCESSORS[architecture].elf_machine.to_bytes(2, "little") + bytes(44)


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    (tmp_path / "numpy").mkdir()
    (tmp_path / "numpy/core.so").write_bytes(elf("arm64"))
    (tmp_path / "numpy/core.py").write_text("pure")
    (tmp_path / "numpy/dangling.so").symlink_to("nowhere")
    (tmp_path / "empty").write_bytes(b"")
    return tmp_path


def test_a_tree_of_one_processor_is_good(tree: Path) -> None:
    require_own_code(tree, "arm64")


def test_foreign_machine_code_is_named(tree: Path) -> None:
    (tree / "stray.so").write_bytes(elf("amd64"))
    with pytest.raises(ForeignCodeError, match=r"^not machine code for arm64: stray\.so$"):
        require_own_code(tree, "arm64")


def test_a_tree_without_machine_code_is_no_package_of_ours(tmp_path: Path) -> None:
    with pytest.raises(ForeignCodeError, match="no machine code"):
        require_own_code(tmp_path, "amd64")


@pytest.mark.parametrize("processor", ["x86_64", "aarch64"])
def test_wheels_are_chosen_for_the_processor_and_debian_12(processor: str) -> None:
    options = wheel_options("arm64")
    platforms = {option.removeprefix("--platform=") for option in options if option.startswith("--platform=")}
    wheel = f"numpy-2.4.6-cp311-cp311-manylinux_2_27_{processor}.manylinux_2_28_{processor}.whl"
    tags: frozenset[Tag] = parse_wheel_filename(wheel)[3]
    assert bool({tag.platform for tag in tags} & platforms) == (processor == "aarch64")
    assert not any("2_39" in platform for platform in platforms)
