"""Applanix SBET: 17 little-endian doubles a record; forward-right-down over NED, wander azimuth frame."""

import numpy as np

from pipeline.gps_time import NS, WEEK_NS
from pipeline.simulation.ins import Columns
from pipeline.simulation.novatel import velocities

WANDER_RAD = np.radians(-1.25)


def sbet_bytes(ins: Columns) -> bytes:
    """Return the file's bytes. Platform heading = true heading + wander; NED has the same roll, pitch and heading."""
    record = np.zeros((len(ins["t_ns"]), 17), "<f8")
    record[:, 0] = ins["t_ns"] % WEEK_NS / NS
    record[:, 1], record[:, 2], record[:, 3] = ins["latitude_rad"], ins["longitude_rad"], ins["height_m"]
    speed = velocities(ins)
    cosine, sine = np.cos(WANDER_RAD), np.sin(WANDER_RAD)
    record[:, 4], record[:, 5] = cosine * speed.north - sine * speed.east, sine * speed.north + cosine * speed.east
    record[:, 6] = -speed.up
    record[:, 7], record[:, 8] = ins["roll_rad"], ins["pitch_rad"]
    record[:, 9] = (ins["azimuth_rad"] + WANDER_RAD) % (2 * np.pi)
    record[:, 10] = WANDER_RAD
    return record.tobytes()
