"""The running service: its threads, the queues between them, and the files each of them owns."""

from typing import Final

from drawings.canvas import Canvas

BUS_Y: Final = 40.0
THREADS_Y: Final = 130.0
FILES_Y: Final = 350.0
THREAD: Final = (156.0, 96.0)


def _thread(sheet: Canvas, x: float, y: float, name: str, *lines: str) -> None:
    sheet.box(x, y, *THREAD)
    sheet.text(x + THREAD[0] / 2, y + 22, name, style="bold")
    sheet.lines_of_text(x + THREAD[0] / 2, y + 44, lines)


def _queue(sheet: Canvas, x: float, y: float, to_x: float, *lines: str) -> None:
    """Three boxes in a row with an arrow in and out, and below them what they hold."""
    sheet.arrow([(x, y), (to_x, y)], "blue")
    middle = (x + to_x) / 2
    for n in range(3):
        sheet.box(middle - 22 + 13 * n, y - 9, 13, 18, radius=1)
    sheet.lines_of_text(middle - 3, y + 26, lines)


def _file(sheet: Canvas, x: float, y: float, name: str, line: str) -> None:
    """A sheet with a folded corner."""
    sheet.line([(x, y), (x + 110, y), (x + 126, y + 16), (x + 126, y + 52), (x, y + 52), (x, y)], "orange")
    sheet.line([(x + 110, y), (x + 110, y + 16), (x + 126, y + 16)], "orange")
    sheet.text(x + 63, y + 24, name, ink="orange", style="small")
    sheet.lines_of_text(x + 63, y + 42, (line,))


def service() -> str:
    """The drawing as SVG."""
    sheet = Canvas(880, 500, "Threads, queues and files of the running service")
    first, second, third = 30.0, 310.0, 590.0
    half = THREAD[0] / 2
    sheet.text(first + half, BUS_Y, "CAN bus", style="bold")
    sheet.arrow([(first + half, BUS_Y + 10), (first + half, THREADS_Y)], "blue")
    sheet.text(
        first + half + 10, BUS_Y + 50, "frames, stamped by the kernel", ink="soft", style="small", anchor="start"
    )
    _thread(
        sheet,
        first,
        THREADS_Y,
        "can-receiver",
        "listens, never sends;",
        "can-around beside it",
        "while a sensor is silent",
    )
    _queue(sheet, first + THREAD[0], THREADS_Y + 48, second, "inbox: bounded,", "drops are counted")
    _thread(sheet, second, THREADS_Y, "pipeline", "decodes, cuts batches,", "estimates")
    _queue(sheet, second + THREAD[0], THREADS_Y + 48, third, "held rows: bounded,", "losses are counted")
    _thread(sheet, third, THREADS_Y, "store-writer", "writes; keeps rows while", "the disk refuses")
    _thread(sheet, third, BUS_Y - 32, "ring-log", "only where it is enabled;", "a block in two minutes")
    sheet.line([(second + half, THREADS_Y), (second + half, BUS_Y + 16)], "blue")
    sheet.arrow([(second + half, BUS_Y + 16), (third, BUS_Y + 16)], "blue")
    sheet.text(second + half + 10, BUS_Y + 6, "frames: bounded, counted", ink="soft", style="small", anchor="start")
    _file(sheet, third + THREAD[0] + 4, BUS_Y - 10, "record/", "segments")
    below = THREADS_Y + THREAD[1]
    lower = FILES_Y - 70
    _thread(sheet, second, lower, "main", "web server, watchdog,", "reload, start and stop")
    _thread(sheet, first, lower, "uplink", "only where a broker", "is configured")
    sheet.arrow([(second + half, below), (second + half, lower)], "blue")
    sheet.text(
        second + half + 10, below + 30, "board: the latest, immutable", ink="soft", style="small", anchor="start"
    )
    _file(sheet, third + 15, lower + 5, "springscale.db", "estimates, events")
    sheet.arrow([(third + half, below), (third + half, lower + 5)], "orange")
    sheet.arrow([(third + 15, lower + 40), (second + THREAD[0], lower + 40)], "orange", dashes="5 4")
    sheet.text((third + second + THREAD[0]) / 2 + 8, lower + 58, "reads only", ink="soft", style="small")
    bottom = lower + THREAD[1]
    uplink_middle = first + half
    sheet.line(
        [(third + 78, lower + 57), (third + 78, bottom + 95), (uplink_middle + 20, bottom + 95)], "orange", dashes="5 4"
    )
    sheet.arrow([(uplink_middle + 20, bottom + 95), (uplink_middle + 20, bottom)], "orange", dashes="5 4")
    sheet.text(uplink_middle + 32, bottom + 88, "reads only; its place is kept in the database", ink="soft",
               style="small", anchor="start")  # fmt: skip
    sheet.arrow([(first + 20, bottom), (first + 20, bottom + 40)], "blue")
    sheet.text(first + 20, bottom + 56, "MQTT", ink="soft", style="small")
    _file(sheet, second - 30, bottom + 10, "known_weights.json", "owned by main")
    _file(sheet, second + 110, bottom + 10, "tokens.json", "springscale token")
    _file(sheet, third + 110, bottom + 10, "batches/", "owned by batch-keeper")
    return sheet.svg()
