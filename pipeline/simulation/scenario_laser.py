"""Settings of the laser scanner of a simulated session, with all its errors."""

from typing import Annotated, Literal

from pydantic import Field

from pipeline.config.mount import Mount
from pipeline.config.quantities import Angle, Latency, Model, NotNegative

Share = Annotated[float, Field(ge=0, le=1)]
Bias = Annotated[float, Field(ge=-1, le=1)]


class LaserScenario(Model):
    """The laser scanner: mount, rates, noise and files."""

    mount: Mount = Mount(roll_deg=0.35, pitch_deg=-0.22, yaw_deg=0.41, x_m=0.21, y_m=0.48, z_m=1.10)  # the truth
    coarse_angle_deg: NotNegative = 0.0  # error of each angle in session.yaml, its sign random
    coarse_lever_m: NotNegative = 0.0  # the same of the lever arm
    coarse_error: Mount | None = None  # instead: each parameter's error, session.yaml's minus true
    point_rate_hz: Annotated[float, Field(ge=1, le=1e6)] = 20000.0
    line_rate_hz: Annotated[float, Field(gt=0, le=1000)] = 50.0
    field_deg: tuple[Angle, Angle] = (30.0, 130.0)  # from the scanner's zenith
    max_range_m: Annotated[float, Field(ge=1, le=1000)] = 40.0
    range_sigma_m: NotNegative = 0.005
    angle_sigma_deg: NotNegative = 0.003
    outlier_share: Share = 0.005  # of the rays: they get a random range
    water_return_share: Share = 0.02  # of the rays that meet the water: they give a point up to 0.3 m beyond it
    splash_share: Share = 0.0  # of the rays to splash_height_m or less above the water: they end in drops or foam
    splash_height_m: NotNegative = 0.2
    splash_depth_m: NotNegative = 0.1  # which are up to this far before the surface
    range_bias_m: Bias = 0.0  # added to all ranges of faces
    incidence_bias_m: Bias = 0.0  # added to ranges at 45° of incidence; beyond 80° as at 80°
    incidence_law: Literal["secant", "tangent_squared"] = "tangent_squared"  # grows with 1 / cos i - 1, or with tan² i
    level_bias_m: Bias = 0.0  # added to ranges of level faces
    spot_m: NotNegative = 0.0  # diameter of the beam where it leaves the scanner; with a width it mixes at edges
    spot_divergence_deg: NotNegative = 0.0  # angle by which the beam widens, in full
    latency_s: Latency = 0.0  # recorded time = true time + latency
    latency_declared_s: Latency = 0.0
    frame: Literal["laser", "EPSG:4978"] = "laser"  # EPSG:4978: placed in ECEF with the recorded INS
    format: Literal["laz", "las"] = "laz"
    scale_m: Annotated[float, Field(ge=1e-6, le=0.01)] = 1e-4
    time: Literal["adjusted_standard", "week_seconds"] = "adjusted_standard"
