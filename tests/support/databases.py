"""The same messages as DBC, KCD and ARXML (AUTOSAR 4), written by hand so that no reader of ours has a part in it."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SomeSignal:
    """A signal; ``start`` counts as a DBC does (big-endian: the most significant bit)."""

    name: str
    start: int
    length: int
    unit: str
    scale: float = 1.0
    offset: float = 0.0
    is_signed: bool = False
    is_big_endian: bool = False
    is_float: bool = False
    minimum: float = 0.0
    maximum: float = 1.0


@dataclass(frozen=True, slots=True)
class SomeMessage:
    """A message of these signals."""

    name: str
    can_id: int
    n_bytes: int
    signals: Sequence[SomeSignal]
    is_extended: bool = False


def dbc(messages: Sequence[SomeMessage]) -> str:
    """The messages as Vector writes them."""
    lines = ['VERSION ""', "NS_ :", "BS_:", "BU_: A"]
    for m in messages:
        lines.append(f"BO_ {m.can_id | (m.is_extended << 31)} {m.name}: {m.n_bytes} A")
        lines += [
            f" SG_ {s.name} : {s.start}|{s.length}@{int(not s.is_big_endian)}"
            f"{'-' if s.is_signed or s.is_float else '+'} "
            f'({s.scale},{s.offset}) [{s.minimum}|{s.maximum}] "{s.unit}" A'
            for s in m.signals
        ]
    for m in messages:
        number = m.can_id | (m.is_extended << 31)
        lines += [f"SIG_VALTYPE_ {number} {s.name} : {s.length // 32};" for s in m.signals if s.is_float]
    return "\n".join(lines) + "\n"


def kcd(messages: Sequence[SomeMessage]) -> str:
    """The messages as Kayak writes them."""
    return (
        '<?xml version="1.0" encoding="UTF-8"?>'
        '<NetworkDefinition xmlns="http://kayak.2codeornot2code.org/1.0"><Document name="d"/><Bus name="b">'
        + "".join(
            f'<Message id="0x{m.can_id:X}" name="{m.name}" length="{m.n_bytes}" '
            f'format="{"extended" if m.is_extended else "standard"}">{"".join(map(_kcd_signal, m.signals))}</Message>'
            for m in messages
        )
        + "</Bus></NetworkDefinition>"
    )


def _kcd_signal(s: SomeSignal) -> str:
    kind = ("double" if s.length == 64 else "single") if s.is_float else "signed" if s.is_signed else "unsigned"
    return (
        f'<Signal name="{s.name}" offset="{_kcd_offset(s)}" length="{s.length}" '
        f'endianess="{"big" if s.is_big_endian else "little"}"><Value type="{kind}" slope="{s.scale}" '
        f'intercept="{s.offset}" unit="{s.unit}" min="{s.minimum}" max="{s.maximum}"/></Signal>'
    )


def _kcd_offset(s: SomeSignal) -> int:
    """The offset as cantools reads it: a big-endian signal by its first bit, bytes counted from their top."""
    return 8 * (s.start // 8) + 7 - s.start % 8 if s.is_big_endian else s.start


def arxml(messages: Sequence[SomeMessage]) -> str:
    """The messages as AUTOSAR's tools write them, as little of it as a bus needs."""
    elements = []
    triggerings = []
    for m in messages:
        triggerings.append(
            _named(
                "CAN-FRAME-TRIGGERING",
                f"{m.name}_T",
                f'<FRAME-REF DEST="CAN-FRAME">/P/{m.name}</FRAME-REF>'
                f"<CAN-ADDRESSING-MODE>{'EXTENDED' if m.is_extended else 'STANDARD'}</CAN-ADDRESSING-MODE>"
                + ("<CAN-FRAME-RX-BEHAVIOR>CAN-FD</CAN-FRAME-RX-BEHAVIOR>" if m.n_bytes > 8 else "")
                + f"<IDENTIFIER>{m.can_id}</IDENTIFIER>",
            )
        )
        mapping = (
            "<PACKING-BYTE-ORDER>MOST-SIGNIFICANT-BYTE-LAST</PACKING-BYTE-ORDER>"
            f'<PDU-REF DEST="I-SIGNAL-I-PDU">/P/{m.name}_PDU</PDU-REF><START-POSITION>0</START-POSITION>'
        )
        elements.append(
            _named(
                "CAN-FRAME",
                m.name,
                f"<FRAME-LENGTH>{m.n_bytes}</FRAME-LENGTH><PDU-TO-FRAME-MAPPINGS>"
                f"{_named('PDU-TO-FRAME-MAPPING', m.name + '_M', mapping)}</PDU-TO-FRAME-MAPPINGS>",
            )
        )
        placed = "".join(_named("I-SIGNAL-TO-I-PDU-MAPPING", s.name + "_M", _placed(m, s)) for s in m.signals)
        elements.append(
            _named(
                "I-SIGNAL-I-PDU",
                m.name + "_PDU",
                f"<LENGTH>{m.n_bytes}</LENGTH><I-SIGNAL-TO-PDU-MAPPINGS>{placed}</I-SIGNAL-TO-PDU-MAPPINGS>",
            )
        )
        elements += [_arxml_signal(f"{m.name}_{s.name}", s) for s in m.signals]
    channel = _named(
        "CAN-PHYSICAL-CHANNEL", "channel", f"<FRAME-TRIGGERINGS>{''.join(triggerings)}</FRAME-TRIGGERINGS>"
    )
    cluster = _named(
        "CAN-CLUSTER",
        "bus",
        "<CAN-CLUSTER-VARIANTS><CAN-CLUSTER-CONDITIONAL><BAUDRATE>500000</BAUDRATE><PHYSICAL-CHANNELS>"
        f"{channel}</PHYSICAL-CHANNELS></CAN-CLUSTER-CONDITIONAL></CAN-CLUSTER-VARIANTS>",
    )
    return (
        '<?xml version="1.0" encoding="UTF-8"?><AUTOSAR xmlns="http://autosar.org/schema/r4.0" '
        'xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" '
        'xsi:schemaLocation="http://autosar.org/schema/r4.0 AUTOSAR_4-2-2.xsd"><AR-PACKAGES>'
        + _named("AR-PACKAGE", "P", f"<ELEMENTS>{cluster}{''.join(elements)}</ELEMENTS>")
        + "</AR-PACKAGES></AUTOSAR>"
    )


def _named(tag: str, name: str, content: str) -> str:
    return f"<{tag}><SHORT-NAME>{name}</SHORT-NAME>{content}</{tag}>"


def _placed(m: SomeMessage, s: SomeSignal) -> str:
    order = "FIRST" if s.is_big_endian else "LAST"
    return (
        f'<I-SIGNAL-REF DEST="I-SIGNAL">/P/{s.name}</I-SIGNAL-REF>'
        f"<PACKING-BYTE-ORDER>MOST-SIGNIFICANT-BYTE-{order}</PACKING-BYTE-ORDER>"
        f"<START-POSITION>{s.start}</START-POSITION>"
    )


def _arxml_signal(unique: str, s: SomeSignal) -> str:
    """The signal with all that hangs on it; names of signals must be unique in the package."""
    coding = "IEEE754" if s.is_float else "2C" if s.is_signed else "NONE"
    base = f"<BASE-TYPE-SIZE>{s.length}</BASE-TYPE-SIZE><BASE-TYPE-ENCODING>{coding}</BASE-TYPE-ENCODING>"
    raw = sorted(((s.minimum - s.offset) / s.scale, (s.maximum - s.offset) / s.scale))
    scale = (
        f'<COMPU-SCALE><LOWER-LIMIT INTERVAL-TYPE="CLOSED">{raw[0]}</LOWER-LIMIT>'
        f'<UPPER-LIMIT INTERVAL-TYPE="CLOSED">{raw[1]}</UPPER-LIMIT><COMPU-RATIONAL-COEFFS><COMPU-NUMERATOR>'
        f"<V>{s.offset}</V><V>{s.scale}</V></COMPU-NUMERATOR><COMPU-DENOMINATOR><V>1</V></COMPU-DENOMINATOR>"
        "</COMPU-RATIONAL-COEFFS></COMPU-SCALE>"
    )
    compu = (
        f'<CATEGORY>LINEAR</CATEGORY><UNIT-REF DEST="UNIT">/P/{unique}_U</UNIT-REF><COMPU-INTERNAL-TO-PHYS>'
        f"<COMPU-SCALES>{scale}</COMPU-SCALES></COMPU-INTERNAL-TO-PHYS>"
    )
    props = (
        "<SW-DATA-DEF-PROPS-VARIANTS><SW-DATA-DEF-PROPS-CONDITIONAL>"
        f'<BASE-TYPE-REF DEST="SW-BASE-TYPE">/P/{unique}_B</BASE-TYPE-REF>'
        f'<COMPU-METHOD-REF DEST="COMPU-METHOD">/P/{unique}_C</COMPU-METHOD-REF>'
        f'<UNIT-REF DEST="UNIT">/P/{unique}_U</UNIT-REF>'
        "</SW-DATA-DEF-PROPS-CONDITIONAL></SW-DATA-DEF-PROPS-VARIANTS>"
    )
    system = _named("SYSTEM-SIGNAL", unique + "_S", f"<PHYSICAL-PROPS>{props}</PHYSICAL-PROPS>")
    signal = _named(
        "I-SIGNAL",
        s.name,
        f"<LENGTH>{s.length}</LENGTH><NETWORK-REPRESENTATION-PROPS>{props}</NETWORK-REPRESENTATION-PROPS>"
        f'<SYSTEM-SIGNAL-REF DEST="SYSTEM-SIGNAL">/P/{unique}_S</SYSTEM-SIGNAL-REF>',
    )
    unit = _named("UNIT", unique + "_U", f"<DISPLAY-NAME>{s.unit}</DISPLAY-NAME>")
    return (
        signal
        + system
        + _named("COMPU-METHOD", unique + "_C", compu)
        + unit
        + _named("SW-BASE-TYPE", unique + "_B", base)
    )
