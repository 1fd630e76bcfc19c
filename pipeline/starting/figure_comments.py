"""Comments in a new session.yaml with the figures that hold unless a person states them, and with the block about."""

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import BaseModel

from pipeline.config.instruments import Sensor
from pipeline.config.mount import MountSigma
from pipeline.config.session import Drift, Laser, Mbes, White
from pipeline.starting.yaml_words import comment

_NOISE = {  # of a sensor without a preset
    "laser": {key: Laser.model_fields[key].default for key in ("range_sigma_m", "angle_sigma_deg")},
    "mbes": {key: Mbes.model_fields[key].default for key in ("range_sigma_m", "angle_sigma_deg", "beam_deg")},
}
_ON_THE_CERTIFICATE = ("vessel", "client", "place", "surveyor", "laser_calibration", "target_survey")


def figure_comments(sensor: Sensor, has_preset: bool) -> Iterator[str]:
    """Yield the comments on a sensor's figures, each with the line to take the comment sign from.

    Parameters
    ----------
    sensor
        The sensor.
    has_preset
        Whether a preset gives the sensor's noise.
    """
    if sensor == "ins":
        yield from _figures(
            "Noise of each record, from the data sheet. Assumed unless you state it:", {"white": _model(White())}
        )
        yield from _figures(
            "Slow errors. Assumed where the files hold no accuracies; stated here, they override those of the files:",
            {"drift": _model(Drift())},
        )
        return
    if not has_preset:
        yield from _figures("Noise, from the data sheet. Assumed unless you state it:", _NOISE[sensor])
    if sensor == "laser":
        yield from _figures(
            "Sigmas of the laser's own mount, from its calibration. The uncertainty of the sonar's values rests on "
            "them. Assumed unless you state them:",
            {"mount_sigma": _model(MountSigma())},
        )


def about_comments() -> Iterator[str]:
    """Yield the comments on the block about, with the keys that every certificate should have."""
    yield from comment("What the certificate says of boat and people; all keys: docs/certificate.md.")
    yield "# about:"
    yield from (f"#   {key}:" for key in _ON_THE_CERTIFICATE)


def _model(values: BaseModel) -> str:
    return "{" + ", ".join(f"{key}: {value:g}" for key, value in values) + "}"


def _figures(words: str, figures: Mapping[str, Any]) -> Iterator[str]:
    yield from comment(words, "  ")
    for key, value in figures.items():
        yield f"  # {key}: {list(value) if isinstance(value, tuple) else value}"
