"""Settings of the INS of a simulated session, with all its errors."""

from typing import Annotated, Literal

from pydantic import Field

from pipeline.config.quantities import Model, NotNegative
from pipeline.config.session import Drift, White

NO_DRIFT = Drift(horizontal_m=0.0, vertical_m=0.0, roll_pitch_deg=0.0, heading_deg=0.0)


class InsScenario(Model):
    """The INS: rate, noise and files."""

    rate_hz: Annotated[float, Field(ge=1, le=1000)] = 200.0
    white: White = White()
    drift: Drift = NO_DRIFT
    second_drift: Drift = NO_DRIFT  # on top of drift, with its own time constant; session.yaml is silent about it
    drift_declared: Drift | None = None  # what session.yaml says; null: drift
    gnss_step_m: NotNegative = 0.0  # RMS of the step of each position coordinate at every full second
    format: Literal["inspvas", "inspva", "inspvasa", "inspvaa", "sbet"] = "inspvas"  # inspvasa, inspvaa: ASCII
    files: Literal["session", "pass"] = "session"  # one file per session or per pass
    aligning_s: Annotated[float, Field(ge=0, le=3600)] = 5.0  # aligning before the first pass (novatel), 1 Hz
