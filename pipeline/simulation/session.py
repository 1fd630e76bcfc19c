"""A simulated pool session: in memory, and written as a session folder of instrument files."""

import json
import os
import shutil
import time
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from pipeline.errors import ConfigError
from pipeline.simulation.beams import fan_angles
from pipeline.simulation.documents import INS_SUFFIX, pool_text, session_text, truth_text
from pipeline.simulation.georeferenced import laser_in_ecef
from pipeline.simulation.ins import Columns, record_ins
from pipeline.simulation.las import write_las
from pipeline.simulation.laser import record_laser
from pipeline.simulation.mbes import record_mbes
from pipeline.simulation.mesh import build_mesh, corner_lines, corner_segments
from pipeline.simulation.motion import Movement
from pipeline.simulation.novatel import aligning_bodies, inspva_bodies, novatel_bytes
from pipeline.simulation.r2sonic_packets import bth0_packets, xtf_bytes
from pipeline.simulation.raycast import Pool, RayCaster
from pipeline.simulation.relief import Relief
from pipeline.simulation.sbet import sbet_bytes
from pipeline.simulation.scenario import Scenario, load_scenario
from pipeline.simulation.scenario_mbes import MbesScenario
from pipeline.simulation.tables import write_soundings


@dataclass(frozen=True)
class SimulatedSession:
    """Records of the instruments as canonical raw columns, and the documents that go with them."""

    ins: Columns  # t_ns, latitude_rad, longitude_rad, height_m, roll_rad, pitch_rad, azimuth_rad
    laser: Columns  # t_ns, x_m, y_m, z_m in the scanner's frame, or in ECEF by the scenario's laser.frame
    mbes: Columns  # t_ns, ping, beam, two_way_time_s, angle_rad, transmit_tilt_rad, sound_speed_m_s; detections only
    session: dict[str, Any]  # session.yaml
    pool: dict[str, Any]  # pool.yaml
    truth: dict[str, Any]  # OUT.truth.json
    ins_rows: list[int]  # first row of each pass, and the number of rows
    laser_rows: list[int]
    pings: Columns  # every ping: t_ns, ping, pass
    further: dict[str, tuple[Columns, Columns]] = field(default_factory=dict)  # of further heads: as mbes, and pings

    @property
    def raw(self) -> dict[str, Columns]:
        """The records of all instruments by sensor."""
        heads = {name: records for name, (records, _) in self.further.items()}
        return {"ins": self.ins, "laser": self.laser, "mbes": self.mbes, **heads}


def simulate_session(scenario: Scenario, seed: int) -> SimulatedSession:
    """Simulate one session.

    The same scenario and seed give the same numbers; each noise source has its own generator.

    Raises
    ------
    ConfigError
        The seed is negative, or a face with a fault is none of the target's.
    """
    if seed < 0:
        raise ConfigError(f"seed = {seed}: must not be negative; choose another seed")
    movement = Movement(scenario, seed)
    target = scenario.target
    mesh = build_mesh(target, scenario.surroundings)
    caster = RayCaster(mesh, Relief(target, scenario.surroundings, mesh, seed))
    pool = Pool(caster, target.water_level_m, corner_lines(target), corner_segments(target))
    ins, ins_rows = record_ins(scenario.ins, movement, seed)
    laser, laser_rows = record_laser(scenario.laser, movement, pool, seed)
    if scenario.laser.frame != "laser":
        laser = laser_in_ecef(laser, ins, scenario.laser)
    mbes, pings = record_mbes(scenario.mbes, movement, pool, seed)
    return SimulatedSession(
        ins=ins,
        laser=laser,
        mbes=mbes,
        session=session_text(scenario, movement, seed),
        pool=pool_text(scenario, movement),
        truth=truth_text(scenario, movement, seed),
        ins_rows=ins_rows,
        laser_rows=laser_rows,
        pings=pings,
        further={
            name: record_mbes(head, movement, pool, seed, number)
            for number, (name, head) in enumerate(scenario.further.items(), start=1)
        },
    )


def write_session(simulated: SimulatedSession, folder: Path, scenario: Scenario) -> None:
    """Write the session folder, and the truth beside it. The folder appears complete or not at all.

    Parameters
    ----------
    simulated : SimulatedSession
        The session.
    folder : Path
        The session folder; it must not exist, or be empty.
    scenario : Scenario
        The session's scenario, which names the formats.

    Raises
    ------
    ConfigError
        The folder exists and is not empty, or it cannot be written.
    """
    _refuse_existing(folder)
    partial = folder.with_name(f".{folder.name}.partial")
    beside = folder.with_name(f".{folder.name}.truth.json.partial")
    try:
        shutil.rmtree(partial, ignore_errors=True)  # left by a run that was killed
        partial.mkdir(parents=True)
        _write_files(simulated, partial, scenario)
        beside.write_text(json.dumps(simulated.truth, indent=1) + "\n", encoding="utf-8")
        beside.replace(truth_path(folder))
        partial.replace(folder)
    except OSError as error:
        raise ConfigError(f"{folder}: cannot be written ({error.strerror}); choose another folder") from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)
        with suppress(OSError):
            beside.unlink()


def truth_path(folder: Path) -> Path:
    """Return OUT.truth.json beside (never inside) the session folder OUT."""
    return folder.with_name(folder.name + ".truth.json")


def simulate_to_folder(folder: Path, scenario_path: Path | None, seed: int) -> dict[str, Any]:
    """Simulate and write a session.

    Parameters
    ----------
    folder : Path
        The session folder; it must not exist, or be empty.
    scenario_path : Path or None
        The scenario's YAML file or name; None: the default scenario.
    seed : int
        Seed of all random numbers.

    Returns
    -------
    dict
        Paths of the files, numbers of records in them, and the run time in seconds.

    Raises
    ------
    ConfigError
        The scenario, the seed or the folder cannot be used.
    """
    begin = time.perf_counter()
    folder = Path(os.path.abspath(folder))
    scenario = load_scenario(scenario_path)
    _refuse_existing(folder)  # checked before the simulation, which takes long
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(f"{folder.parent}: cannot be made ({error.strerror}); choose another folder") from error
    simulated = simulate_session(scenario, seed)
    write_session(simulated, folder, scenario)
    return {
        "session": folder,
        "pool": folder / "pool.yaml",
        "truth": truth_path(folder),
        "ins_records": len(simulated.ins["t_ns"]),
        "laser_points": len(simulated.laser["t_ns"]),
        "soundings": sum(len(simulated.raw[head]["t_ns"]) for head in scenario.heads),
        "seconds": time.perf_counter() - begin,
    }


def _refuse_existing(folder: Path) -> None:
    try:
        taken = folder.exists() and not (folder.is_dir() and not any(folder.iterdir()))
    except OSError as error:
        raise ConfigError(f"{folder}: cannot be read ({error.strerror}); choose another folder") from error
    if taken or not folder.name:
        raise ConfigError(f"{folder}: exists already; choose another name, or remove it first")


def _write_files(simulated: SimulatedSession, folder: Path, scenario: Scenario) -> None:
    for name in simulated.raw:
        (folder / name).mkdir()
    _write_ins(simulated, folder / "ins", scenario)
    day = datetime.fromisoformat(scenario.start_utc).date()
    for k in range(len(scenario.track.distances_m)):
        points = _rows(simulated.laser, simulated.laser_rows[k], simulated.laser_rows[k + 1])
        write_las(folder / "laser" / f"pass_{k}.{scenario.laser.format}", points, scenario.laser, day)
        for head, (mbes, pings) in {"mbes": (simulated.mbes, simulated.pings), **simulated.further}.items():
            of_pass = _rows(pings, *np.searchsorted(pings["pass"], [k, k + 1]))
            first, last = (of_pass["ping"][[0, -1]] if len(of_pass["ping"]) else (0, -1))
            rows = _rows(mbes, *np.searchsorted(mbes["ping"], [first, last + 1]))
            _write_mbes(rows, of_pass, folder / head, k, scenario.heads[head])
    for name, text in (("session.yaml", simulated.session), ("pool.yaml", simulated.pool)):
        (folder / name).write_text(yaml.safe_dump(text, sort_keys=False), encoding="utf-8")


def _write_ins(simulated: SimulatedSession, folder: Path, scenario: Scenario) -> None:
    form, suffix = scenario.ins.format, INS_SUFFIX[scenario.ins.format]
    rows = simulated.ins_rows if scenario.ins.files == "pass" else [0, simulated.ins_rows[-1]]
    for k in range(len(rows) - 1):
        ins = _rows(simulated.ins, rows[k], rows[k + 1])
        path = folder / (f"pass_{k}.{suffix}" if scenario.ins.files == "pass" else f"ins.{suffix}")
        if form == "sbet":
            path.write_bytes(sbet_bytes(ins))
            continue
        before = aligning_bodies(int(ins["t_ns"][0]), scenario.ins.aligning_s if k == 0 else 0.0)
        path.write_bytes(novatel_bytes(np.concatenate([before, inspva_bodies(ins)]), form))


def _write_mbes(mbes: Columns, pings: Columns, folder: Path, k: int, head: MbesScenario) -> None:
    path = folder / f"pass_{k}.{head.format}"
    if head.format == "parquet":
        write_soundings(path, mbes)
        return
    packet = bth0_packets(mbes, pings, fan_angles(head), head)
    path.write_bytes(xtf_bytes(packet, path.name) if head.format == "xtf" else packet.tobytes())


def _rows(columns: Columns, start: int, stop: int) -> Columns:
    return {name: values[start:stop] for name, values in columns.items()}
