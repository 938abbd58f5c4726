"""What makes a package one for amd64 or arm64: the wheels that pip may choose, and the machine code in the tree."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Final

NEWEST_GLIBC_MINOR: Final = 36  # 2.36 is Debian 12's
OLDEST_GLIBC_MINOR: Final = 17
ELF_MAGIC: Final = b"\x7fELF"
ELF_MACHINE_AT: Final = slice(18, 20)  # e_machine, little endian here


@dataclass(frozen=True, slots=True)
class Processor:
    """One processor as wheels and as ELF files name it."""

    wheel_name: str
    elf_machine: int


PROCESSORS: Final = {"amd64": Processor("x86_64", 62), "arm64": Processor("aarch64", 183)}


class ForeignCodeError(RuntimeError):
    """A tree holds machine code of another processor, or none at all."""


def wheel_options(architecture: str) -> list[str]:
    """Options by which pip takes wheels for Debian 12 on that processor, whatever machine it runs on."""
    processor = PROCESSORS[architecture].wheel_name
    minors = range(NEWEST_GLIBC_MINOR, OLDEST_GLIBC_MINOR - 1, -1)
    platforms = [f"manylinux_2_{minor}_{processor}" for minor in minors] + [f"manylinux2014_{processor}"]
    abis = (f"cp{sys.version_info.major}{sys.version_info.minor}", "abi3", "none")
    return [
        "--only-binary=:all:",
        "--implementation=cp",
        f"--python-version={sys.version_info.major}.{sys.version_info.minor}",
        *(f"--abi={abi}" for abi in abis),
        *(f"--platform={platform}" for platform in platforms),
    ]


def require_own_code(tree: Path, architecture: str) -> None:
    """See that every ELF file below ``tree`` is for that processor. Raises ForeignCodeError with those that are not."""
    machines = {file: machine for file in tree.rglob("*") if (machine := elf_machine(file)) is not None}
    if not machines:
        raise ForeignCodeError(f"{tree} holds no machine code at all")
    foreign = [file for file, machine in machines.items() if machine != PROCESSORS[architecture].elf_machine]
    if foreign:
        names = ", ".join(str(file.relative_to(tree)) for file in sorted(foreign))
        raise ForeignCodeError(f"not machine code for {architecture}: {names}")


def elf_machine(file: Path) -> int | None:
    """The processor an ELF file is for, by its number there; None for any other file."""
    if file.is_symlink() or not file.is_file():
        return None
    with file.open("rb") as opened:
        head = opened.read(ELF_MACHINE_AT.stop)
    return int.from_bytes(head[ELF_MACHINE_AT], "little") if head.startswith(ELF_MAGIC) else None
