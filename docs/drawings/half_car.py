"""The half-car: masses, springs, axes after ISO 8855, signs, and where the sensor sits."""

import math
from typing import Final

from drawings.canvas import Canvas, Point

FRONT_X: Final = 190.0
PIXELS_PER_M: Final = 150.0
WHEELBASE_M: Final = 2.8
SENSOR_M: Final = 3.2
PAYLOAD_M: Final = 1.9
EMPTY_M: Final = 1.4
BODY_Y: Final = 170.0
WHEEL_Y: Final = 300.0
ROAD_Y: Final = 375.0


def _x(behind_front_m: float) -> float:
    return FRONT_X + PIXELS_PER_M * behind_front_m


def _spring(sheet: Canvas, x: float, top: float, bottom: float) -> None:
    inner = (bottom - top) * 0.7
    begin = top + (bottom - top) * 0.15
    turns = [(x + (8.0 if n % 2 else -8.0), begin + inner * (n + 0.5) / 7) for n in range(7)]
    sheet.line([(x, top), (x, begin), *turns, (x, begin + inner), (x, bottom)])


def _damper(sheet: Canvas, x: float, top: float, bottom: float) -> None:
    middle = (top + bottom) / 2
    sheet.line([(x, top), (x, middle - 3)])
    sheet.line([(x - 7, middle - 3), (x + 7, middle - 3)])
    sheet.line([(x - 10, middle - 14), (x - 10, middle + 12), (x + 10, middle + 12), (x + 10, middle - 14)])
    sheet.line([(x, middle + 12), (x, bottom)])


def _axle(sheet: Canvas, x: float, end: str, name: str) -> None:
    sheet.line([(x - 16, BODY_Y + 17), (x - 16, BODY_Y + 30), (x + 16, BODY_Y + 30), (x + 16, BODY_Y + 17)])
    _spring(sheet, x - 16, BODY_Y + 30, WHEEL_Y - 24)
    _damper(sheet, x + 16, BODY_Y + 30, WHEEL_Y - 24)
    sheet.text(x + 34, (BODY_Y + WHEEL_Y) / 2 + 10, f"K_{{{end}}}", anchor="start")
    sheet.box(x - 30, WHEEL_Y - 24, 60, 26)
    sheet.text(x, WHEEL_Y - 7, f"m_{{u,{end}}}")
    _spring(sheet, x, WHEEL_Y + 2, _road(x))
    sheet.text(x + 14, WHEEL_Y + 34, "k_{t}", anchor="start")
    sheet.text(x, ROAD_Y + 26, name, ink="soft", style="small")


def _road(x: float) -> float:
    """A road for the eye: its height at the rear axle is what the front axle met a wheelbase ago."""
    return ROAD_Y - 5.0 * math.sin(x / 23.0) - 3.0 * math.sin(x / 9.7 + 1.0)


def _measure(sheet: Canvas, y: float, to_m: float, name: str) -> None:
    sheet.arrow([(_x(0), y), (_x(to_m), y)], "soft", width=1.2, both=True)
    sheet.text((_x(0) + _x(to_m)) / 2, y - 6, name, ink="soft", style="small")


def _arc_at(sheet: Canvas, centre: Point, radius: float, ink: str) -> None:
    """A quarter turn, nose (on the left) down."""
    half = math.radians(38.0)
    begin = (centre[0] + radius * math.sin(half), centre[1] - radius * math.cos(half))
    end = (centre[0] - radius * math.sin(half), centre[1] - radius * math.cos(half))
    sheet.arc(centre, radius, begin, end, ink)


def _axes(sheet: Canvas) -> None:
    origin = (90.0, 84.0)
    sheet.arrow([origin, (30.0, 84.0)], "blue")
    sheet.arrow([origin, (90.0, 34.0)], "blue")
    sheet.circle(origin, 7.0)
    sheet.circle(origin, 2.5, kind="fill blue")
    sheet.text(28, 76, "x forward", ink="blue", style="small", anchor="start")
    sheet.text(90, 26, "z up", ink="blue", style="small")
    sheet.text(104, 88, "y left, towards you", ink="blue", style="small", anchor="start")


def _body(sheet: Canvas) -> None:
    sheet.box(_x(-0.55), BODY_Y - 17, PIXELS_PER_M * 4.0, 34)
    sheet.box(_x(PAYLOAD_M) - 40, BODY_Y - 59, 80, 42, radius=2)
    sheet.text(_x(PAYLOAD_M), BODY_Y - 34, "payload L", style="small")
    sheet.circle((_x(EMPTY_M), BODY_Y), 5.0, kind="fill ink")
    sheet.text(_x(EMPTY_M) + 12, BODY_Y + 5, "empty mass M, pitch inertia J", style="small", anchor="start")
    for behind_m, end in ((0.0, "f"), (WHEELBASE_M, "r")):
        sheet.arrow([(_x(behind_m), BODY_Y - 17), (_x(behind_m), BODY_Y - 58)], "orange")
        sheet.text(_x(behind_m) + 8, BODY_Y - 46, f"y_{{{end}}}", ink="orange", anchor="start")


def _sensor(sheet: Canvas) -> None:
    x = _x(SENSOR_M)
    sheet.arrow([(x, BODY_Y - 17), (x, BODY_Y - 82)], "blue", width=2)
    sheet.text(x, BODY_Y - 112, "vertical acceleration", ink="blue", style="small")
    sheet.text(x, BODY_Y - 96, "+9.81 m/s² at rest", ink="blue", style="small")
    sheet.box(x - 14, BODY_Y - 11, 28, 22, radius=2)
    sheet.text(x, BODY_Y + 5, "IMU", ink="blue", style="small")
    _arc_at(sheet, (x, BODY_Y + 70), 46.0, "blue")
    sheet.text(x + 44, BODY_Y + 46, "pitch rate,", ink="blue", style="small", anchor="start")
    sheet.text(x + 44, BODY_Y + 61, "positive nose down", ink="blue", style="small", anchor="start")


def half_car() -> str:
    """The drawing as SVG."""
    sheet = Canvas(840, 500, "The half-car, its axes and signs (ISO 8855), and the sensor on its body")
    _axes(sheet)
    _body(sheet)
    for behind_m, end, name in ((0.0, "f", "front axle"), (WHEELBASE_M, "r", "rear axle")):
        _axle(sheet, _x(behind_m), end, name)
    _sensor(sheet)
    road = [(float(x), _road(x)) for x in range(30, 811, 4)]
    sheet.line(road, width=2)
    sheet.text(_x(0) - 40, ROAD_Y + 26, "z(t)", ink="orange", anchor="end")
    sheet.text(_x(WHEELBASE_M) - 40, ROAD_Y + 26, "z(t − τ),  τ = l / v", ink="orange", anchor="end")
    sheet.arrow([(150, 352), (60, 352)], "soft")
    sheet.text(105, 345, "drives at v", ink="soft", style="small")
    for number, (to_m, name) in enumerate(
        ((PAYLOAD_M, "d: payload position"), (WHEELBASE_M, "l: wheelbase"), (SENSOR_M, "x_{s}: sensor position"))
    ):
        _measure(sheet, ROAD_Y + 60 + 24 * number, to_m, name)
    return sheet.svg()
