"""The target in a pool's config that is to be found in the session's laser points: ``target: {kind: found}``.

It is found before any stage runs, and its faces are put into the settings. Therefore all other code knows faces only,
and a run's settings hold the corners that were used.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from pipeline.config.quantities import Model
from pipeline.config.target import FaceName, Masks
from pipeline.config.water_by_time import WaterByTime
from pipeline.config.yaml_models import parse
from pipeline.errors import ConfigError

DEPTH_M = 4.0  # below the water, to which faces are continued unless another depth is given
DEPTHS_M = (0.5, 100.0)  # those that may be given


Gaps = Literal["repeated", "seen", "none"]


class Found(Model):
    """What is said of a target that is to be found: how deep its faces go on, which are struck, and masks by face."""

    kind: Literal["found"]
    depth_m: Annotated[float, Field(ge=DEPTHS_M[0], le=DEPTHS_M[1])] = DEPTH_M
    strike: tuple[FaceName, ...] = ()  # faces that are no wall below the water
    masks: dict[FaceName, Masks] = Field(default_factory=dict)  # parts of faces that do not count
    gaps: Gaps = "repeated"  # between courses, that become masks: also below the water if they repeat, or none there
    water_by_time: WaterByTime | None = None  # null: the level stays


class _OfPool(Model):
    target: Found


Find = Callable[[Found], Mapping[str, Any]]  # returns the content of a pool's file, with target and as_built


def with_found(content: dict[str, Any], path: Path, find: Find | None) -> dict[str, Any]:
    """Return the content of a pool's file with the faces of a target that is to be found.

    Parameters
    ----------
    content, path
        The file's content, and its path for messages.
    find
        Function that finds the target; None: there are no laser points to find it in.

    Raises
    ------
    ConfigError
        There is nothing to find it in, or a face to be struck or masked is not among those that were found.
    """
    target = content.get("target")
    if not isinstance(target, dict) or target.get("kind") != "found":
        return content
    wanted = parse(_OfPool, {"target": target}, str(path)).target
    if wanted.water_by_time is not None and wanted.water_by_time.readings is not None:
        raise ConfigError(
            f"{path}: target.water_by_time.readings: what is found does not say how high the water stood at the first "
            "reading; give ins_above_water_m, or the file that poolcal target --out writes, with water_level_m"
        )
    if find is None:
        raise ConfigError(
            f"{path}: target.kind: found: there are no laser points here to find it in; run poolcal target on a "
            "session that was recorded there, and give the file that its --out writes"
        )
    found = find(wanted)
    faces = found["target"]["faces"]
    for key, names in (("strike", wanted.strike), ("masks", tuple(wanted.masks))):
        for name in names:
            if name not in faces:
                raise ConfigError(f"{path}: target.{key}: {name!r}: no such face was found, but {', '.join(faces)}")
    masks = {name: [one.model_dump(mode="json") for one in each] for name, each in wanted.masks.items()}
    left = {
        name: face | {"masks": [*face.get("masks", []), *masks[name]]} if name in masks else face
        for name, face in faces.items()
        if name not in wanted.strike
    }
    if not left:
        raise ConfigError(f"{path}: target.strike: no face is left of {', '.join(faces)}; leave one, or more")
    built = content.get("as_built")
    as_built = found["as_built"] | built if isinstance(built, dict) else built or found["as_built"]
    of_water = {key: target[key] for key in ("water_by_time",) if key in target}
    return content | {"target": {**found["target"], "faces": left, **of_water}, "as_built": as_built}
