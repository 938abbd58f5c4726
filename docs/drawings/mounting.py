"""Where a sensor goes: on the floor, level, arrow ahead; and where it does not."""

from typing import Final

from drawings.canvas import Canvas

FLOOR_Y: Final = 190.0


def mounting() -> str:
    """A van from the side, good and bad places, and the axes of the box."""
    sheet = Canvas(760, 340, "Where to fix the sensor")
    sheet.line([(90, FLOOR_Y), (90, 90), (150, 60), (600, 60), (600, FLOOR_Y), (90, FLOOR_Y)])
    sheet.line([(250, 60), (250, FLOOR_Y)], "soft", dashes="4 4")
    sheet.text(245, 50, "bulkhead", ink="soft", style="small", anchor="end")
    for x, name in ((170.0, "front axle"), (520.0, "rear axle")):
        sheet.circle((x, 225), 32)
        sheet.line([(x, FLOOR_Y), (x, 225)], "soft", dashes="3 3")
        sheet.text(x, 280, name, ink="soft", style="small")
    for x, name in ((345.0, "good"), (440.0, "good"), (545.0, "good: far behind")):
        sheet.box(x - 13, FLOOR_Y - 14, 26, 14, radius=2)
        sheet.text(x, FLOOR_Y - 22, name, style="small")
    for x, y, name in ((142.0, 118.0, "no: dashboard"), (205.0, 150.0, "no: seat"), (330.0, 70.0, "no: roof skin")):
        sheet.circle((x, y), 6)
        sheet.text(x, y - 10 if y > 80 else y + 24, name, ink="soft", style="small")
    sheet.arrow([(170, 305), (440, 305)], "soft", width=1.2, both=True)
    sheet.text(305, 300, "sensor_position_m, behind the front axle", ink="soft", style="small")
    sheet.box(690, 150, 40, 22, radius=2)
    sheet.arrow([(710, 161), (662, 161)], width=1.4)
    sheet.text(656, 165, "x ahead", style="small", anchor="end")
    sheet.arrow([(710, 161), (710, 112)], width=1.4)
    sheet.text(710, 104, "z up", style="small")
    sheet.text(710, 192, "y to the left", style="small")
    return sheet.svg()
