"""The vessel's true movement in the target frame: straight passes or circles, with waves on every coordinate."""

from dataclasses import dataclass
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from pipeline.gps_time import NS, gps_ns_from_unix_utc
from pipeline.simulation.random_streams import generator
from pipeline.simulation.scenario import Scenario
from pipeline.simulation.site import Floats, Site

Times = NDArray[np.int64]
WAVES = ("sway", "surge", "heave", "roll", "pitch", "heading")  # x, y, z, and the three angles
SECOND_PERIOD = 0.37


@dataclass(frozen=True)
class TruePoses:
    """The INS's true poses at n epochs."""

    position_target_m: Floats  # (n, 3)
    R_target_from_body: Floats  # (n, 3, 3)
    latitude_rad: Floats
    longitude_rad: Floats
    height_m: Floats
    roll_rad: Floats
    pitch_rad: Floats
    azimuth_rad: Floats


class Movement:
    """All passes of a scenario. Between two passes the vessel turns to port and comes back."""

    def __init__(self, scenario: Scenario, seed: int) -> None:
        track, motion = scenario.track, scenario.motion
        self.site = Site(scenario.target.origin, scenario.azimuth_deg)
        self.half_length_m = scenario.half_length_m
        self.speed_m_s = track.speed_m_s
        self.height_m = scenario.target.water_level_m + track.ins_height_m
        self.azimuth_rad = np.radians(scenario.azimuth_deg + motion.heading_offset_deg)
        self.offset_rad = np.radians([motion.roll_offset_deg, motion.pitch_offset_deg])
        self.distances_m = track.distances_m
        self.between = track.log_between_passes
        amplitudes = np.array([getattr(motion, name).amplitude for name in WAVES])
        self.amplitudes = np.where(np.arange(6) < 3, amplitudes, np.radians(amplitudes))
        self.periods_s = np.array([getattr(motion, name).period_s for name in WAVES])
        self.margin_ns, gap_ns = round(track.margin_s * NS), round(track.gap_s * NS)
        passes = range(len(track.distances_m))
        self.courses = [track.courses[k % len(track.courses)] for k in passes]
        self.radius_m = track.circle_radius_m
        ways_m = {"circle": 2 * float(np.pi) * self.radius_m}
        straight_m = 2 * self.half_length_m
        lengths_ns = [round(ways_m.get(course, straight_m) / self.speed_m_s * NS) for course in self.courses]
        first_ns, starts = session_start_ns(scenario) + self.margin_ns, np.cumsum([0, *lengths_ns[:-1]]).tolist()
        self.starts_ns = [first_ns + starts[k] + k * (2 * self.margin_ns + gap_ns) for k in passes]
        self.ends_ns = [start + length_ns for start, length_ns in zip(self.starts_ns, lengths_ns, strict=True)]
        self.phases_rad = [generator(seed, "motion", k).uniform(0, 2 * np.pi, (6, 2)) for k in passes]

    @property
    def passes(self) -> range:
        """Numbers of the passes."""
        return range(len(self.distances_m))

    def sensors_run_ns(self, k: int) -> tuple[int, int]:
        """Return first and last time (GPS ns) of laser and sonar in pass ``k``.

        With ``log_between_passes`` the last time is the start of the next pass.
        """
        goes_on = self.between and k + 1 < len(self.starts_ns)
        return self.starts_ns[k], self.starts_ns[k + 1] if goes_on else self.ends_ns[k]

    def ins_runs_ns(self, k: int) -> tuple[int, int]:
        """Return first and last time (GPS ns) of the INS's log for pass ``k``: the sensors' times with the margins."""
        start, end = self.sensors_run_ns(k)
        before = 0 if self.between and k > 0 else self.margin_ns
        after = 0 if end != self.ends_ns[k] else self.margin_ns
        return start - before, end + after

    def pose(self, k: int, t_ns: Times) -> TruePoses:
        """Return true poses in (or after) pass ``k`` at times (n,), GPS ns."""
        x, y, z, roll, pitch, azimuth = self._states(k, t_ns)
        position = np.stack([x, y, z], axis=1)
        latitude, longitude, height = self.site.geodetic_from_target(position)
        R_target_from_level = self.site.R_target_from_level(latitude, longitude)
        R_target_from_body = R_target_from_level @ R_level_from_body(roll, pitch, azimuth)
        return TruePoses(
            position_target_m=position,
            R_target_from_body=R_target_from_body,
            latitude_rad=latitude,
            longitude_rad=longitude,
            height_m=height,
            roll_rad=roll,
            pitch_rad=pitch,
            azimuth_rad=azimuth % (2 * np.pi),
        )

    def _states(self, k: int, t_ns: Times) -> Floats:
        """Return x, y, z, roll, pitch, azimuth, (6, n), with a smooth transition to the next pass after the margin."""
        states = self._pass_states(k, t_ns)
        if not (self.between and k + 1 < len(self.starts_ns)):
            return states
        begin, end = self.ends_ns[k] + self.margin_ns, self.starts_ns[k + 1] - self.margin_ns
        u = np.clip((t_ns - begin) / max(end - begin, 1), 0.0, 1.0)
        share = u**3 * (10 - 15 * u + 6 * u**2)
        states = np.asarray((1 - share) * states + share * self._pass_states(k + 1, t_ns))
        states[5] -= 2 * np.pi * share  # a full circle to port: the starboard side turns away from the target
        return states

    def _pass_states(self, k: int, t_ns: Times) -> Floats:
        seconds = (t_ns - self.starts_ns[k]) / NS
        phases = self.phases_rad[k]
        states = np.empty((6, len(t_ns)))
        for row in range(6):
            turn = 2 * np.pi * seconds / self.periods_s[row]
            wave = 0.75 * np.sin(turn + phases[row, 0]) + 0.25 * np.sin(turn / SECOND_PERIOD + phases[row, 1])
            states[row] = self.amplitudes[row] * wave
        states[0] -= self.distances_m[k]
        states[2] += self.height_m
        states[3:5] += self.offset_rad[:, None]
        states[5] += self.azimuth_rad
        way_m = self.speed_m_s * seconds
        if self.courses[k] == "circle":
            turned = way_m / self.radius_m  # heading first into the target, then farther to starboard
            states[0] += self.radius_m * np.sin(turned)
            states[1] += self.radius_m * np.cos(turned)
            states[5] += np.pi / 2 + turned
        elif self.courses[k] == "back":
            states[1] += self.half_length_m - way_m
            states[5] += np.pi
        else:
            states[1] += way_m - self.half_length_m
        return states


def R_level_from_body(roll_rad: Floats, pitch_rad: Floats, azimuth_rad: Floats) -> Floats:
    """Return Rz(-azimuth) Rx(pitch) Ry(roll), multiplied out because scipy takes ten times as long.

    The columns are the directions of starboard, bow and mast in east, north, up. Starboard goes down with roll, the bow
    up with pitch.

    Parameters
    ----------
    roll_rad, pitch_rad, azimuth_rad : (n,) arrays
        Attitude of the body.

    Returns
    -------
    (n, 3, 3) array
    """
    sr, cr, sp, cp = np.sin(roll_rad), np.cos(roll_rad), np.sin(pitch_rad), np.cos(pitch_rad)
    sa, ca = np.sin(azimuth_rad), np.cos(azimuth_rad)
    starboard = [ca * cr + sa * sp * sr, -sa * cr + ca * sp * sr, -cp * sr]
    bow = [sa * cp, ca * cp, sp]
    mast = [ca * sr - sa * sp * cr, -sa * sr - ca * sp * cr, cp * cr]
    return np.stack([np.stack(axis, axis=-1) for axis in (starboard, bow, mast)], axis=-1)


def session_start_ns(scenario: Scenario) -> int:
    """Return the start of the session, GPS ns."""
    unix_s = round((datetime.fromisoformat(scenario.start_utc) - datetime(1970, 1, 1)).total_seconds())
    return int(gps_ns_from_unix_utc(np.array([unix_s]), np.array([0]))[0])
