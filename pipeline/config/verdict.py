"""What a calibration is for, and the largest total sigmas with which it is accepted."""

from typing import Annotated, Literal

from pydantic import Field

from pipeline.config.quantities import Model, Positive

Purpose = Literal["pool", "construction", "exclusive_order", "special_order", "order_1a", "order_1b", "order_2"]


class VerdictLimits(Model):
    """The largest total sigmas of an accepted calibration, stated or by what the survey is for.

    For a purpose other than ``pool``, no mount parameter alone, nor all together, may take more than ``mount_share`` of
    the uncertainty (TVU, THU) that its order allows a sounding, at any depth down to ``depth_m`` and any angle up to
    ``swath_deg``. A number that is stated goes before the limit of a sigma; soundings are judged all the same.
    """

    purpose: Purpose = "pool"
    depth_m: Annotated[float, Field(ge=1, le=12000)] = 20.0  # largest depth below the sonar
    swath_deg: Annotated[float, Field(ge=10, le=80)] = 60.0  # largest angle of a beam from the vertical
    mount_share: Annotated[float, Field(gt=0, le=1)] = 0.3  # of TVU and of THU
    max_sigma_deg: Positive | None = None
    max_sigma_m: Positive | None = None
