"""Settings of the sonar of a simulated session, with all its errors."""

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from pipeline.config.mount import Mount
from pipeline.config.quantities import (
    Depth,
    Latency,
    Lever,
    Model,
    NotNegative,
    Positive,
    SoundSpeed,
    TransmitSectors,
)
from pipeline.simulation.scenario_laser import Bias, Share

Count = Annotated[int, Field(ge=1, le=20)]
Factor = Annotated[float, Field(ge=1, le=100)]
Profile = Annotated[tuple[tuple[Depth, SoundSpeed], ...], Field(max_length=1000)]  # depth below the water, speed
STEEPEST_TILT_DEG = 45.0
_Tilt = Annotated[float, Field(ge=-STEEPEST_TILT_DEG, le=STEEPEST_TILT_DEG)]


class MbesScenario(Model):
    """The sonar: mount, beams, noise, sound speed and files."""

    mount: Mount = Mount(roll_deg=-48.8, pitch_deg=1.2, yaw_deg=-2.0, x_m=0.30, y_m=0.20, z_m=-2.01)  # the truth
    coarse_angle_deg: NotNegative = 0.8  # error of each coarse angle, its sign random
    coarse_lever_m: NotNegative = 0.08  # the same of the coarse lever arm
    coarse_error: Mount | None = None  # instead: each parameter's error, coarse minus true
    ping_rate_hz: Annotated[float, Field(gt=0, le=100)] = 20.0
    beams: Annotated[int, Field(ge=2, le=1024)] = 256
    sector_deg: Annotated[float, Field(gt=0, le=170)] = 130.0
    spacing: Literal["equi_angle", "equidistant"] = "equi_angle"  # section A0 or A2
    sectors: TransmitSectors = ()  # tilts of the transmit fan by receive angle; none: no tilt
    ping_tilts_deg: Annotated[tuple[_Tilt, ...], Field(max_length=16)] = ()  # added to all sectors', in turn by ping
    max_range_m: Annotated[float, Field(ge=1, le=500)] = 15.0
    range_sigma_m: NotNegative = 0.008
    range_bias_m: Bias = 0.0  # added to all ranges of faces
    incidence_noise: Factor = 1.0  # at 45° of incidence i: variance × (1 + (f² - 1) tan² i), as at 80° beyond
    slanted_noise: Factor = 1.0  # the same factor with the incidence along track alone
    incidence_bias_m: Bias = 0.0  # added to ranges at 45° of incidence; beyond 80° as at 80°
    incidence_law: Literal["secant", "tangent_squared"] = "secant"  # grows with 1 / cos i - 1, or with tan² i
    level_bias_m: Bias = 0.0  # added to ranges of level faces, whose echo may be that of the corner behind
    ping_range_sigma_m: NotNegative = 0.0  # noise common to all ranges of a ping
    ping_roll_sigma_deg: NotNegative = 0.0  # noise common to all angles of a ping
    angle_sigma_deg: NotNegative = 0.06
    array_ripple_deg: NotNegative = 0.0  # angles off by this times sin 2θ: errors of the array
    steering_sigma_deg: NotNegative = 0.0  # further noise of the angles, alike in neighbouring beams of a ping
    steering_correlation: Annotated[float, Field(ge=0, lt=1)] = 0.8  # of two neighbours; of n beams apart its nth power
    beam_deg: tuple[Positive, Positive] = (0.5, 1.0)  # across, along track
    point_beams: bool = False  # true: beams without width
    sub_rays: tuple[Count, Count] = (5, 3)  # rays per beam, across and along; odd
    aperture_m: tuple[NotNegative, NotNegative] = (0.0, 0.0)  # near field: no beam is narrower, across and along
    corner_share: Share = 0.3  # of the beams within corner_reach_m of an inner corner: they get its range
    corner_reach_m: NotNegative = 0.1
    side_lobe_share: Share = 0.0  # of the beams near an inner corner: they get its range through a side lobe
    side_lobe_widths: NotNegative = 2.0  # how near, in beam widths
    side_lobe_pull: Share = 1.0  # and if both echoes are as one: this share of the way from the face's range to it
    outlier_share: Share = 0.02  # of the beams: they get a random range
    surface_share: Share = 0.04  # of the beams above 30° below the horizon: they get the water surface's range
    image_share: Share = 0.0  # of the beams to image_depth_m or less below the water: back by way of the surface
    image_depth_m: NotNegative = 0.3
    dropped_ping_share: Share = 0.01
    sound_speed_true_m_s: SoundSpeed = 1500.0
    sound_speed_recorded_m_s: SoundSpeed = 1500.0
    sound_speed_gradient_1_s: Annotated[float, Field(ge=-2, le=2)] = 0.0  # (m/s)/m downward from the head's true speed
    sound_speed_profile: Profile = ()  # true speed by depth, constant beyond its ends; none: true speed and gradient
    svp_declared: Profile = ()  # the cast in session.yaml; none: no cast
    head_speed_excess: Annotated[float, Field(ge=-0.1, le=0.1)] = 0.0  # sound at the arrays faster by this share
    give_true_sound_speed: bool = False  # true: session.yaml has the true one
    projector_offset_m: tuple[Lever, Lever, Lever] = (0.0, 0.0, 0.0)  # transmitter in the mbes frame
    give_projector_offset: bool = False
    latency_s: Latency = 0.0
    pps_jitter_s: Annotated[float, Field(ge=0, le=0.01)] = 0.0  # noise of each ping's recorded time
    stamp: Literal["transmission", "reception"] = "transmission"  # reception: each detection's own, format parquet
    latency_declared_s: Latency = 0.0
    format: Literal["xtf", "r2s", "parquet"] = "xtf"  # r2s: packets one after another; parquet: a table, with tilts
    intensity: bool = True  # section I1

    @model_validator(mode="after")
    def _odd(self) -> "MbesScenario":
        if any(count % 2 == 0 for count in self.sub_rays):
            raise ValueError(f"sub_rays = {list(self.sub_rays)} must be odd: the middle one is the beam's axis")
        return self

    @model_validator(mode="after")
    def _stamped(self) -> "MbesScenario":
        if self.stamp == "reception" and self.format != "parquet":
            raise ValueError(
                f"format = {self.format}: the sonar's own packets hold one time a ping, stamp: reception gives each "
                "detection its own; write format: parquet"
            )
        return self

    @model_validator(mode="after")
    def _layered(self) -> "MbesScenario":
        for name in ("sound_speed_profile", "svp_declared"):
            depths = [depth for depth, _ in getattr(self, name)]
            if len(depths) == 1 or any(other <= one for one, other in pairwise(depths)):
                raise ValueError(f"{name} = {depths} m: needs two depths or more, each greater than the one before")
        if self.sound_speed_profile and (self.sound_speed_gradient_1_s or self.give_true_sound_speed):
            raise ValueError(
                "sound_speed_profile says what sound_speed_gradient_1_s and give_true_sound_speed say otherwise: leave "
                "these out"
            )
        return self

    @model_validator(mode="after")
    def _tilted(self) -> "MbesScenario":
        if not self.sectors and not self.ping_tilts_deg:
            return self
        if self.format != "parquet":
            raise ValueError(
                f"format = {self.format}: the sonar's own packets hold no transmit tilt, which sectors and "
                "ping_tilts_deg give; write format: parquet"
            )
        tilts = [sector.tilt_deg + tilt_deg for sector in self.sectors for tilt_deg in self.ping_tilts_deg]
        steepest = max(tilts, key=abs, default=0.0)
        if abs(steepest) > STEEPEST_TILT_DEG:
            raise ValueError(f"sectors and ping_tilts_deg add up to {steepest}°: at most 45° is possible")
        return self
