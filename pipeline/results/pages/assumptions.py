"""What enters the stated uncertainty though nobody stated it: defaults of the program, in words, for all that say so.

The certificate names all such figures; ``poolcal check`` and the screen after a run name those of the INS's drift.
"""

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from pipeline.config.session import Laser, SessionConfig
from pipeline.run.origins import is_assumed, value_of
from pipeline.run.settings import Settings, read_settings

OF_INS = {
    "ins.drift.horizontal_m": "horizontal {} mm",
    "ins.drift.vertical_m": "vertical {} mm",
    "ins.drift.roll_pitch_deg": "roll and pitch {}°",
    "ins.drift.heading_deg": "heading {}°",
    "ins.drift.time_constant_s": "time constant {} s",
}
OF_LASER = {
    "laser.range_bias_sigma_m": "all of the laser {} mm",
    "laser.incidence_bias_sigma_m": "of the laser at 45° incidence {} mm",
}
OF_SONAR = {
    "mbes.range_bias_sigma_m": "all of the sonar {} mm",
    "mbes.incidence_bias_sigma_m": "of the sonar at 45° incidence {} mm",
    "mbes.level_bias_sigma_m": "of the sonar on horizontal faces {} mm",
}
SINGLE_FACES = {"as_built.face_sigma_m": "single faces {} mm"}
WET_FACES = {
    "as_built.offset_sigma_m": "wet faces against dry ones {} mm",
    "as_built.angle_sigma_deg": "their angle {}°",
    "as_built.bow_sigma_m": "their bow {} mm",
    "as_built.growth_sigma_m": "growth on all of them {} mm",
}
LASER_FIT = {
    "laser_fit.face_sigma_deg": "directions of its faces {}°",
    "laser_fit.face_sigma_m": "distances of its faces {} mm",
    "laser_fit.plumb_sigma_deg": "out of plumb {}°",
}
COARSE = {"laser_fit.coarse_sigma_deg": "angles {}°", "laser_fit.coarse_sigma_m": "lever arm {} mm"}
MOUNT = {"laser.mount_sigma.angle_deg": "angles {}°", "laser.mount_sigma.lever_arm_m": "lever arm {} mm"}
SOUND_SPEED = {
    "mbes.sound_speed_sigma_m_s": "{} m/s",
    "mbes.sound_speed_gradient_sigma_1_s": "{} m/s per metre of depth",
}
CAST = {"mbes.svp_sigma_m_s": "each speed of the cast {} m/s"}
CLOCKS = {"laser.latency_sigma_s": "of the laser {} ms", "mbes.latency_sigma_s": "of the sonar {} ms"}
IN_THOUSANDTHS = ("_m", "latency_sigma_s")  # ends of keys that are shown in mm or ms


def assumed_groups(settings: Settings, from_files: Collection[str]) -> Iterator[Mapping[str, str | list[str]]]:
    """Yield each group of figures that enter the total sigmas and that neither a file nor a preset gave, in words.

    Figures that the data correct by their variance factors (noise of ranges, of angles, of the INS's records) are none.

    Parameters
    ----------
    settings
        The run's settings.
    from_files
        The figures of the drift that the INS's files gave: ``horizontal_m``, say. The time constant is never theirs.
    """
    for words, keys in _groups(settings.session).items():
        figures = list(_assumed(settings, keys, from_files).values())
        if figures:
            yield {"words": words, "figures": figures}


def note_of_run(run: Path, result: Mapping[str, Any]) -> str:
    """Return the note on a run's drift; ``result``: the content of its calibration.json."""
    return drift_note(read_settings(run), result["ins_drift"]["from_files"])


def drift_note(settings: Settings, from_files: Collection[str]) -> str:
    """Return the note that figures of the INS's drift are assumed; empty if none is but the time constant.

    Parameters
    ----------
    settings, from_files
        As in :func:`assumed_groups`.
    """
    figures = _assumed(settings, OF_INS, from_files)
    if not figures.keys() - {"ins.drift.time_constant_s"}:
        return ""
    words = ", ".join(figures.values())
    if settings.session.ins.drift_from == "files":
        return (
            "these figures of the INS's drift are assumed, for neither session.yaml nor the INS's log states them: "
            f"{words}"
        )
    return (
        "these figures of the INS's drift are assumed, for session.yaml does not state them, and because of its "
        f"ins.drift or ins.drift_from no accuracies of the INS's log are used: {words}"
    )


def _assumed(settings: Settings, keys: Mapping[str, str], from_files: Collection[str]) -> dict[str, str]:
    """Return by key those figures, in words, that neither a file of settings nor a preset nor the INS's files gave."""
    given = {f"ins.drift.{name}" for name in from_files}
    assumed = (key for key in keys if key not in given and is_assumed(settings, key))
    return {key: keys[key].format(_number(settings, key)) for key in assumed}


def _groups(session: SessionConfig) -> Mapping[str, Mapping[str, str]]:
    """Return by the words of each group its figures that enter the sigmas of this calibration: keys and their words."""
    laser, mbes = session.laser, session.mbes
    if mbes is None:
        clock = {key: form for key, form in CLOCKS.items() if key.startswith("laser")}
        mount = {"the coarse mount": COARSE if _takes_coarse_sigmas(laser) else {}}
        target, ranges, speed, place = SINGLE_FACES | LASER_FIT, OF_LASER, {}, {}
    else:
        clock, target, ranges = CLOCKS, SINGLE_FACES | WET_FACES, OF_LASER | OF_SONAR
        mount = {"the laser's own mount": MOUNT if laser.mount_covariance is None else {}}
        speed, place = SOUND_SPEED | (CAST if mbes.svp else {}), {"mbes.projector_sigma_m": "{} mm"}
    return {
        "slow errors of the INS": OF_INS,
        **mount,
        "clocks": clock,
        "ranges": ranges,
        "sound speed": speed,
        "place of the transmitter in the sonar": place,
        "the target as built": target,
    }


def _takes_coarse_sigmas(laser: Laser) -> bool:
    """Return whether sigmas of the pool's config enter a calibration of the laser.

    They do unless the session states a covariance of the coarse mount
    (:func:`pipeline.adjustment.laser_design.coarse_mount`). That of a mount that ``poolcal laser`` found is none: its
    origin names the coarse mount that counts, or, of an older version, holds values for which alone it counts.
    """
    origin = laser.mount_origin
    if origin is not None and origin.coarse is not None:
        return origin.coarse.covariance is None
    return laser.mount_covariance is None or (origin is not None and origin.method == "fine")


def _number(settings: Settings, key: str) -> str:
    return f"{value_of(settings, key) * (1000 if key.endswith(IN_THOUSANDTHS) else 1):g}"
