"""The sources of systematic errors: what each is called, and whose it is, so that two sessions can be compared.

An error of a session's *own* is drawn anew each time. An error *common* to two sessions has the same value in both, as
long as what it belongs to is the same: then it cancels in their difference, but for what their geometries make of it.
This table alone says which error is which.
"""

from dataclasses import dataclass
from typing import Any, Literal

from pipeline.config.pool import AsBuilt
from pipeline.config.session import Laser, Mbes
from pipeline.config.target import Target
from pipeline.maths.adjustment.parameters import of_head

Owner = Literal["session", "laser_mount", "laser", "sonar", "target"]  # what an error belongs to
OWNERS: dict[Owner, str] = {
    "session": "the session",
    "laser_mount": "the laser's mount",
    "laser": "the laser",
    "sonar": "the sonar",
    "target": "the target",
}


@dataclass(frozen=True)
class ErrorSource:
    """A source of errors: the beginning of its parameters' names, words for it, what it belongs to, and why."""

    beginning: str
    words: str
    owner: Owner
    reason: str


ERROR_SOURCES = (  # the first beginning that fits counts
    ErrorSource(
        "laser_rotation", "the laser's angles", "laser_mount",
        "the laser is screwed to the bracket, and its surveyed mount is used as it is in every session",
    ),
    ErrorSource(
        "laser_lever_arm", "the laser's lever arm", "laser_mount",
        "as its angles: one survey, used in every session",
    ),
    ErrorSource(
        "laser_range", "the laser's ranges", "laser",
        "the zero of its rangefinder is a property of the device",
    ),
    ErrorSource(
        "laser_latency", "the laser's clock", "session",
        "clocks are synchronised anew when the recording begins, with another remainder",
    ),
    ErrorSource(
        "laser_incidence", "the laser's ranges by incidence", "session",
        "it depends on the faces' paint and on whether they are wet",
    ),
    ErrorSource(
        "mbes_incidence", "the sonar's ranges by incidence", "session",
        "the bottom detection's settings and the growth on the faces are of the day",
    ),
    ErrorSource(
        "mbes_level_range", "the sonar's ranges on horizontal faces", "session",
        "as those by incidence",
    ),
    ErrorSource(
        "projector", "the transmitter's place", "sonar",
        "it is a property of the head",
    ),
    ErrorSource(
        "steering_speed", "sound speed at the arrays", "session",
        "as the sound speed",
    ),
    ErrorSource(
        "mbes_range", "the sonar's ranges", "sonar",
        "the place of its acoustic centre and its detection's delay are properties of the device",
    ),
    ErrorSource(
        "mbes_latency", "the sonar's clock", "session",
        "as the laser's clock",
    ),
    ErrorSource(
        "sound_speed_gradient", "change of the sound speed with depth", "session",
        "the water's layers are of the day, and each cast has errors of its own",
    ),
    ErrorSource(
        "sound_speed", "sound speed", "session",
        "the water is another each day; what a probe has in common from day to day is not told apart",
    ),
    ErrorSource(
        "wet", "wet faces against dry ones", "target",
        "the target was built and surveyed once",
    ),
    ErrorSource(
        "face_", "single faces", "target",
        "as the wet faces",
    ),
    ErrorSource(
        "surfaces_", "the target's design: directions, distances, parallel faces", "target",
        "as the wet faces",
    ),
    ErrorSource("rotation", "the coarse mount", "laser_mount", "an observation where the laser is calibrated"),
    ErrorSource("lever_arm", "the coarse mount", "laser_mount", "as its angles"),
)  # fmt: skip
UNKNOWN = ErrorSource("", "", "session", "not in the table: then its own, for which no two sessions need be alike")


def source_of(parameter: str) -> ErrorSource:
    """Return the source of a parameter's error, by the parameter's name; of a further head as of the first.

    >>> source_of("sound_speed_gradient").owner, source_of("wet_P1_shift").owner
    ('session', 'target')
    """
    _, name = of_head(parameter)
    return next((source for source in ERROR_SOURCES if name.startswith(source.beginning)), UNKNOWN)


def stated_of(laser: Laser, mbes: Mbes, target: Target, as_built: AsBuilt) -> dict[Owner, Any]:
    """Return, by what errors belong to, all settings that must be the same in two sessions that share these errors.

    None: they are never shared. A target is the same if its shape, place and survey are; azimuth and water level do
    not matter.

    Parameters
    ----------
    laser, mbes : Laser, Mbes
        The session's sensors.
    target : Target
        The pool's target.
    as_built : AsBuilt
        Its survey.
    """
    return {
        "session": None,
        "laser_mount": laser.model_dump(mode="json", include={"mount", "mount_sigma", "mount_covariance"}),
        "laser": _device(laser),
        "sonar": _device(mbes),
        "target": {
            "target": target.model_dump(mode="json", exclude={"azimuth_deg", "water_level_m", "water_by_time"}),
            "as_built": as_built.model_dump(mode="json"),
        },
    }


def _device(sensor: Laser | Mbes) -> dict[str, Any]:
    """Return what is stated of a device: its preset, the sigmas of its biases, the place of its transmitter."""
    stated = sensor.model_dump(mode="json")
    kept = {name: stated[name] for name in stated if name.endswith("bias_sigma_m") or name.startswith("projector_")}
    return {"instrument": None if sensor.instrument is None else sensor.instrument.name} | kept
