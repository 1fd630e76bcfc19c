"""The target of the settings as the mathematics takes it."""

from functools import lru_cache

from pipeline.config.target import Faces, Letters, Target
from pipeline.maths.target.model import TargetModel
from pipeline.maths.target.outlines import Outline, Relation, build_target
from pipeline.maths.target.patent_target import PatentDimensions, patent_outlines


def target_of(target: Target) -> TargetModel:
    """Return the target by design; it is cached (building takes a twentieth of a second), so nobody may change it."""
    return _built(type(target), target.model_dump_json())


@lru_cache(maxsize=16)
def _built(kind: type[Letters] | type[Faces], text: str) -> TargetModel:
    target = kind.model_validate_json(text)
    if isinstance(target, Faces):
        outlines = [Outline(name, face.corners, face.role or "", face.seen) for name, face in target.faces.items()]
        relations = [
            Relation(kind, faces, relation.name or "")
            for relation in target.relations
            for kind, faces in relation.given.items()
        ]
        return build_target(outlines, relations, target.water_level_m, target.repeats_m)
    outlines, relations, repeats_m = patent_outlines(
        PatentDimensions(
            a=target.a,
            b=target.b,
            c=target.c,
            e=target.e,
            low_side=target.low_side,
            blocks_per_side=target.blocks_per_side,
            first_base_m=target.first_base_m,
            stagger_m=target.stagger_m,
        )
    )
    return build_target(outlines, relations, target.water_level_m, repeats_m)
