"""Sessions that cannot give all of the mount."""

import shutil
from pathlib import Path

import numpy as np

from pipeline.config.target import Letters
from pipeline.simulation.scenario import load_scenario
from pipeline.simulation.session import simulate_session as simulate_in_memory
from tests.support.places import Place
from tests.support.tables import place_soundings, write_tables


def only_the_wall(small: Path, folder: Path) -> Place:
    """A session of tables that keeps, of the soundings, those on the centre wall and off its edges."""
    scenario = load_scenario(small.with_name("session.scenario.yaml"))
    simulated = simulate_in_memory(scenario, 1)
    points, target = place_soundings(simulated), scenario.target
    assert isinstance(target, Letters)
    keep = (np.abs(points[:, 0]) < 0.1) & (np.abs(points[:, 1]) < target.b / 2 - 0.3)
    keep &= (points[:, 2] < -0.2) & (points[:, 2] > -target.a / 2 + 0.3)
    place = Place(small, folder)
    write_tables(simulated, place.session, "parquet", keep)
    shutil.copy(small / "pool.yaml", place.config)
    return place
