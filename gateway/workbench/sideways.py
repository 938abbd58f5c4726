"""Loads beside the centre line: any plan, its loads moved to the left or the right."""

from dataclasses import replace

import numpy as np

from gateway.workbench.campaigns import Plan, PlannedDrive


def sideways(plan: Plan, most_m: float, rng: np.random.Generator) -> Plan:
    """The same plan with every load somewhere within most_m of the centre line, at one place throughout a drive."""
    return replace(plan, drives=tuple(_sideways(planned, most_m, rng) for planned in plan.drives))


def _sideways(planned: PlannedDrive, most_m: float, rng: np.random.Generator) -> PlannedDrive:
    moved = {
        loads: tuple(replace(load, left_m=float(rng.uniform(-most_m, most_m))) for load in loads)
        for loads in dict.fromkeys(step.loads for step in planned.steps)
    }
    return replace(
        planned,
        carried=tuple(replace(carried, loads=moved[carried.loads]) for carried in planned.carried),
        steps=tuple(replace(step, loads=moved[step.loads]) for step in planned.steps),
    )
