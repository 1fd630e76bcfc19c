"""The target of the settings as the mathematics takes it."""

from functools import lru_cache

from pipeline.config.target import Faces, Letters, Target
from pipeline.maths.target.model import TargetModel
from pipeline.maths.target.outlines import Outline, Relation, build_target
from pipeline.maths.target.patent_target import lettered


def target_of(target: Target) -> TargetModel:
    """The target's faces; nobody changes them, for they are kept: many ask, and it takes a twentieth of a second."""
    return _built(type(target), target.model_dump_json())


@lru_cache(maxsize=16)
def _built(kind: type[Letters] | type[Faces], text: str) -> TargetModel:
    target = kind.model_validate_json(text)
    if isinstance(target, Faces):
        outlines = [Outline(name, one.corners, one.role or "", one.seen) for name, one in target.faces.items()]
        relations = [
            Relation(kind, faces, one.name or "") for one in target.relations for kind, faces in one.given.items()
        ]
        return build_target(outlines, relations, target.water_level_m, target.repeats_m)
    outlines, relations, repeats_m = lettered(
        target.a,
        target.b,
        target.c,
        target.e,
        target.low_side,
        target.blocks_per_side,
        target.first_base_m,
        target.stagger_m,
    )
    return build_target(outlines, relations, target.water_level_m, repeats_m)
