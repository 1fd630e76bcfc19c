"""The report's table of instruments: the figures on which values and uncertainties rest, and the origin of each."""

from collections.abc import Iterator, Mapping
from typing import Any

from pipeline.config.heads import HEADS
from pipeline.config.instruments import SENSORS, Sensor, figures
from pipeline.config.pool import AsBuilt, LaserFit
from pipeline.maths.adjustment.parameters import kind_of
from pipeline.run.origins import origin_of, preset_of, value_of
from pipeline.run.settings import Settings

Row = Mapping[str, Any]
BESIDE: Mapping[Sensor, tuple[str, ...]] = {  # keys that no preset may set
    "ins": ("drift_within.sigmas", "drift_within.time_constant"),
    "laser": ("latency_sigma_s",),
    "mbes": ("sound_speed_sigma_m_s", "sound_speed_gradient_sigma_1_s", "latency_sigma_s"),
}
OF_FILES = "the INS's files"


def instrument_rows(settings: Settings, drift: Mapping[str, Any]) -> list[Row]:
    """Return one row for each figure. The first row of a sensor has the names of the sensor and of its instrument.

    Parameters
    ----------
    settings
        The run's settings.
    drift
        The block ``ins_drift`` of calibration.json: the drift's figures that were used.
    """
    rows: list[Row] = []
    for sensor in (*SENSORS, *HEADS[1:]):
        if getattr(settings.session, sensor) is None:
            continue
        preset = preset_of(settings, sensor)
        for number, (key, value, origin) in enumerate(_figures(settings, sensor, drift)):
            of_preset = preset is not None and origin.startswith("preset")
            rows.append(
                {
                    "sensor": "" if number else sensor,
                    "instrument": "" if number else preset.title if preset else "–",
                    "key": key,
                    "value": value,
                    "origin": origin,
                    "unverified": of_preset and preset is not None and key in preset.unverified,
                }
            )
    for number, key in enumerate(_of_target(settings)):
        row = {"key": key, "value": _shown(value_of(settings, key)), "origin": origin_of(settings, key)}
        first = {"sensor": "" if number else "target", "instrument": "" if number else "–"}
        rows.append(first | row | {"unverified": False})
    return rows


def _of_target(settings: Settings) -> list[str]:
    """Return the keys of the target's figures, in the pool's config, that enter this calibration."""
    as_built, laser_fit = (
        [f"{block}.{name}" for name in model.model_fields if "sigma" in name]
        for block, model in (("as_built", AsBuilt), ("laser_fit", LaserFit))
    )
    return as_built if settings.session.calibrated == "mbes" else ["as_built.face_sigma_m", *laser_fit]


def _figures(settings: Settings, sensor: str, drift: Mapping[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Yield key, value in words, and origin of each figure of a sensor."""
    kind: Sensor = "ins" if sensor == "ins" else kind_of(sensor)
    for key in [*figures(kind), *_beside(settings, kind)]:
        if key.startswith("drift.") and key.removeprefix("drift.") in drift["from_files"]:
            yield key, _shown(drift[key.removeprefix("drift.")]), OF_FILES
        else:
            yield key, _shown(value_of(settings, f"{sensor}.{key}")), origin_of(settings, f"{sensor}.{key}")


def _beside(settings: Settings, sensor: Sensor) -> tuple[str, ...]:
    """Return the keys of a sensor's further figures: of its mount, of a cast, of its clock."""
    more: tuple[str, ...] = ()
    if sensor == "laser" and settings.session.calibrated == "mbes":
        covariance = settings.session.laser.mount_covariance
        more = ("mount_sigma.angle_deg", "mount_sigma.lever_arm_m") if covariance is None else ("mount_covariance",)
    if sensor == "mbes" and settings.session.sonar.svp is not None:
        more = ("svp_sigma_m_s",)
    return more + BESIDE[sensor]


def _shown(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, tuple) and isinstance(value[0], tuple):
        return f"{len(value)} × {len(value[0])}"
    words = {True: "yes", False: "no"}
    numbers = value if isinstance(value, tuple) else (value,)
    return ", ".join(words[number] if isinstance(number, bool) else f"{number:g}" for number in numbers)
