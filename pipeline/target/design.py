"""The model of the target from its settings."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from pipeline.config.target import FaceSettings, Letters, RelationSettings, Target
from pipeline.maths.target.face import Mask
from pipeline.maths.target.model import TargetModel
from pipeline.maths.target.outlines import Outline, Relation, build_target
from pipeline.maths.target.patent_target import PatentDimensions, patent_outlines

EVERYWHERE = (-np.inf, np.inf)


def target_of(target: Target) -> TargetModel:
    """Return the target's model. It is cached, because it takes 0.05 s and has many users: do not change it."""
    if isinstance(target, Letters):
        return _by_letters(target)
    faces = tuple(target.faces.items())
    return _by_faces(faces, target.relations, target.water_level_m, target.repeats_m, target.found)


@lru_cache(maxsize=16)
def _by_letters(target: Letters) -> TargetModel:
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


def _masks(face: FaceSettings, water_level_m: float) -> tuple[Mask, ...]:
    limits = ((mask.along_m or EVERYWHERE, mask.height_m or EVERYWHERE) for mask in face.masks)
    return tuple((*along, water_level_m + low, water_level_m + high) for along, (low, high) in limits)


@lru_cache(maxsize=16)
def _by_faces(
    faces: tuple[tuple[str, FaceSettings], ...],
    relations: tuple[RelationSettings, ...],
    water_level_m: float,
    repeats_m: float | None,
    found: bool,
) -> TargetModel:
    outlines = [
        Outline(name, face.corners, face.role or "", face.seen, _masks(face, water_level_m)) for name, face in faces
    ]
    stated = [
        Relation(kind, names, relation.name or "") for relation in relations for kind, names in relation.given.items()
    ]
    return replace(build_target(outlines, stated, water_level_m, repeats_m), found=found)
