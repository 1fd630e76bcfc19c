"""Targets for tests."""

from pipeline.maths.assembly import build_target
from pipeline.maths.letters import lettered
from pipeline.maths.targets import TargetModel


def by_letters(a: float, b: float, c: float, e: float, water_level_m: float = 0.0, **more: object) -> TargetModel:
    outlines, relations, repeats_m = lettered(a, b, c, e, **more)
    return build_target(outlines, relations, water_level_m, repeats_m)


def members(model: TargetModel, family: str) -> tuple[int, ...]:
    """Numbers of the family's faces."""
    return next(one.faces for one in model.families if one.name == family)
