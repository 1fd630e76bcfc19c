"""The note that nobody stated how the INS drifts: neither session.yaml, nor its preset, nor the INS's log."""

from pipeline.config.session import Drift
from pipeline.run.origins import is_assumed
from pipeline.run.settings import Settings


def assumed_drift(settings: Settings, from_files: bool) -> str:
    """Return the note; an empty text if any figure of the drift is stated, or if the run does not tell.

    Parameters
    ----------
    settings
        The settings of the session.
    from_files
        Whether the INS's files hold accuracies, which are then taken for its drift.
    """
    if from_files or not all(is_assumed(settings, f"ins.drift.{key}") for key in Drift.model_fields):
        return ""
    drift = settings.session.ins.drift
    return (
        f"the INS's log holds no accuracies, and session.yaml states no ins.drift, so its drift is assumed: "
        f"{drift.horizontal_m:g} m horizontal, {drift.vertical_m:g} m vertical, {drift.roll_pitch_deg:g}° in roll and "
        f"pitch, {drift.heading_deg:g}° in heading, time constant {drift.time_constant_s:g} s"
    )
