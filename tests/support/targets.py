"""Targets for tests."""

from typing import Any

from pipeline.maths.target.model import TargetModel
from pipeline.maths.target.outlines import build_target
from pipeline.maths.target.patent_target import PatentDimensions, patent_outlines


def by_letters(a: float, b: float, c: float, e: float, water_level_m: float = 0.0, **more: Any) -> TargetModel:
    outlines, relations, repeats_m = patent_outlines(PatentDimensions(a, b, c, e, **more))
    return build_target(outlines, relations, water_level_m, repeats_m)


def members(model: TargetModel, family: str) -> tuple[int, ...]:
    """Numbers of the family's faces."""
    return next(one.faces for one in model.families if one.name == family)


def as_faces(target: dict[str, Any]) -> dict[str, Any]:
    """A pool's target by its letters, as the same target by its faces: plain values for YAML."""
    place = {"origin", "azimuth_deg", "water_level_m", "water_by_time"}
    letters = {name: value for name, value in target.items() if name not in place | {"kind"}}
    outlines, relations, repeats_m = patent_outlines(PatentDimensions(**letters))
    faces: dict[str, Any] = {}
    for one in outlines:
        faces[one.name] = {"corners": [[float(v) for v in corner] for corner in one.corners]}
        if one.role:
            faces[one.name]["role"] = one.role
    tied = [{one.kind: list(one.faces)} | ({"name": one.name} if one.name else {}) for one in relations]
    found = {"kind": "faces", "faces": faces, "relations": tied, "repeats_m": float(repeats_m)}
    return found | {name: target[name] for name in place if name in target}
