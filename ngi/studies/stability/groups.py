"""All cases, by group."""

from __future__ import annotations

from ngi.studies.stability import (
    accumulation,
    geometry,
    light,
    materials,
    reuse,
    statistics,
    stiffness,
    training,
)

GROUPS = {
    "geometry": geometry.CASES,
    "light": light.CASES,
    "materials": materials.CASES,
    "stiffness": stiffness.CASES,
    "training": training.CASES,
    "reuse": reuse.CASES,
    "statistics": statistics.CASES,
    "accumulation": accumulation.CASES,
}
