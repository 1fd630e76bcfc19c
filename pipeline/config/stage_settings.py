"""The settings of each stage: only settings that it uses, so that a change of another one does not run it again.

A stage names in its Config the blocks that it needs (``laser``, ``mbes``, ``segment``, ...). If it annotates a block
with a narrower model than the block's own, it gets that model, filled with the block's fields of the same names. Keys
have the names of session.yaml, also in the reasons why a stage is run again.
"""

from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeVar, get_args, get_type_hints

from pydantic import BaseModel

from pipeline.config.mount import Covariance, Mount, MountOrigin
from pipeline.config.pool import PoolConfig
from pipeline.config.quantities import Model
from pipeline.config.session import Drift, SessionConfig, White

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

C = TypeVar("C", bound="DataclassInstance")
M = TypeVar("M", bound=BaseModel)


class SensorMount(Model):
    """The coarse mount of a sensor."""

    mount: Mount


class LaserPlacement(Model):
    """Settings that place the laser's points in the pool: its mount, and the frame of its files."""

    mount: Mount
    frame: str


class SonarPlacement(Model):
    """Settings that place soundings in the pool: the mount, and the settings that turn times and angles into points."""

    mount: Mount
    sound_speed_m_s: float | None
    svp: tuple[tuple[float, float], ...] | None
    projector_offset_m: tuple[float, float, float] | None


class SonarBeams(Model):
    """Settings of footprints on the target and of the noise of soundings: the mount, the beams, the sigmas."""

    mount: Mount
    beam_deg: tuple[float, float]
    frequency_hz: float
    aperture_m: tuple[float, float] | None
    focused: tuple[bool, bool]
    angle_sigma_deg: float
    range_sigma_m: float


class LaserPoints(Model):
    """Settings of the laser's points: the mount, what is known of it, the sigmas of range and angle, the beam."""

    mount: Mount
    mount_covariance: Covariance | None
    mount_origin: MountOrigin | None
    range_sigma_m: float
    angle_sigma_deg: float
    beam_m: float


class InsErrors(Model):
    """The INS's errors: its drift, where the drift's figures come from; its white noise."""

    drift: Drift
    drift_from: str
    white: White


class FacesAsBuilt(Model):
    """The target as surveyed: deviations of its faces from the design, and how wet faces may stand to dry ones."""

    faces: dict[str, float]
    offset_sigma_m: float
    angle_sigma_deg: float
    growth_sigma_m: float


class AdjustIteration(Model):
    """Settings of the adjustment's iteration."""

    free: tuple[str, ...]
    max_iterations: int
    robust_k0: float
    robust_k1: float


class PassGaps(Model):
    """The longest time without observations within a pass."""

    max_gap_s: float


class LaserPrior(Model):
    """Prior information for a calibration of the laser itself: sigmas of the target and of the coarse mount."""

    face_sigma_deg: float
    face_sigma_m: float
    plumb_sigma_deg: float
    origin_sigma_m: float | None
    azimuth_sigma_deg: float | None
    coarse_sigma_deg: float
    coarse_sigma_m: float


def narrow(model: type[M], block: BaseModel) -> M:
    """Return an instance of ``model``, filled with the fields of the same names from a larger block of settings."""
    return model.model_validate({name: getattr(block, name) for name in model.model_fields})


def settings_by_name(pool: PoolConfig, session: SessionConfig) -> dict[str, Any]:
    """Return every setting by the name under which a stage's Config asks for it.

    ``mbes`` is None if the laser is calibrated, ``laser_fit`` is None if the sonar is calibrated.
    """
    blocks: tuple[BaseModel, ...] = (pool, session)
    settings = {name: getattr(block, name) for block in blocks for name in type(block).model_fields}
    return settings | {
        "target_place": pool.target_place,
        "recordings": session.recordings,
        "calibrated": session.calibrated,
        "further_heads": {name: head for name, head in session.heads.items() if head is not session.mbes},
        "laser_fit": pool.laser_fit if session.calibrated == "laser" else None,
    }


def stage_config(config: type[C], settings: Mapping[str, Any]) -> C:
    """Build a stage's Config.

    Parameters
    ----------
    config : type
        The stage's Config, a dataclass.
    settings : Mapping[str, Any]
        Every setting by its name, from :func:`settings_by_name`.
    """
    annotations = get_type_hints(config)
    names = [field.name for field in fields(config)]
    return config(**{name: _as_annotated(annotations[name], settings[name]) for name in names})


def plain_settings(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings as plain values for JSON."""
    return {
        name: plain_settings(value)
        if isinstance(value, dict)
        else value.model_dump(mode="json")
        if isinstance(value, BaseModel)
        else value
        for name, value in settings.items()
    }


def _as_annotated(annotation: Any, value: Any) -> Any:
    """Return a setting in the model that a Config annotates: unchanged, or narrowed."""
    choices = get_args(annotation) or (annotation,)
    models = [choice for choice in choices if isinstance(choice, type) and issubclass(choice, BaseModel)]
    if not isinstance(value, BaseModel) or not models or isinstance(value, tuple(models)):
        return value
    (model,) = models
    return narrow(model, value)
