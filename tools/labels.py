"""Compare calibrations under drift with calibrations by the labels of a twin, whose INS does not drift.

A drifting trajectory must not change the labels. Each session of the drift campaign is calibrated twice: with its own
labels, and with those that the target's pose, the mount and the poses of its twin give. The twin has the same true
motion, the same points and the same white noise of the INS. For each mount parameter the program prints the root mean
square of the difference of both results, in sigmas. Rows go to runs/montecarlo/labels.parquet.

    python -m tools.labels [--sessions 50] [--jobs 2] [--resume]
"""

import argparse
from dataclasses import replace
from typing import Any

import numpy as np

from pipeline.artefacts.from_tables import trajectory_in_target
from pipeline.artefacts.schema import Artefact
from pipeline.artefacts.streams import MemoryPart, Stream
from pipeline.config.stage_settings import settings_by_name, stage_config
from pipeline.run.stage_protocol import declared
from pipeline.target.labelled_points import LabellingContext, label_batch
from stages import segment
from stages.in_memory import calibrate_in_memory
from tools.campaign_files import collect_rows
from tools.campaigns import CAMPAIGNS, FOLDER, TASKS_OF_A_WORKER
from tools.session_rows import NAMES, session_in_memory, simulated

(UNDER_DRIFT,) = (campaign for campaign in CAMPAIGNS if campaign.name == "finite beams and INS drift")
DRIFT_FREE = replace(UNDER_DRIFT, name="no drift", scenario={})
SOURCES = {"segment/laser_labelled": "laser_pool", "segment/soundings_labelled": "soundings_pool"}


class TwinLabels:
    """Replaces labelled points by those that a twin's context labels."""

    def __init__(self, twin: LabellingContext) -> None:
        self.twin, self.artefacts = twin, dict[str, Any]()

    def __call__(self, key: str, value: Any) -> Any:
        """Return the artefact for the following stages."""
        self.artefacts[key] = value
        if key not in SOURCES:
            return value
        source, name = SOURCES[key], key.removeprefix("segment/")
        own = trajectory_in_target(self.artefacts["georeference/poses"], self.artefacts["segment/target_pose"])
        context = replace(self.twin, trajectory=own)
        batches = [
            label_batch(source, batch, context).streams[name]
            for batch in self.artefacts[f"georeference/{source}"].batches()
        ]
        columns = {column: np.concatenate([batch[column] for batch in batches]) for column in batches[0]}
        return Stream((MemoryPart(name, columns),))


def context_of_twin(number: int) -> LabellingContext:
    """Return target, mount and poses for labelling, from a session without drift."""
    made, session, pool = simulated(DRIFT_FREE, number)
    raw = {"ins": made.ins, "laser": made.laser, "mbes": made.mbes}
    artefacts = calibrate_in_memory(session, pool, raw, until="georeference")
    inputs = {
        name: artefacts[f"{marker.owner}/{marker.name}"]
        for name, marker in declared(segment.Inputs).items()
        if isinstance(marker, Artefact)
    }
    config = stage_config(segment.Config, settings_by_name(pool, session))
    return segment.prepare(segment.Inputs(**inputs), config)


def row_of(number: int) -> dict[str, Any]:
    """Return the row of a session: the parameters' errors with both labels, and the sigmas."""
    own, by_twin = (
        session_in_memory(UNDER_DRIFT, number, changed)
        for changed in (lambda _, value: value, TwinLabels(context_of_twin(number)))
    )
    row = {"seed": UNDER_DRIFT.first_seed + number} | {f"sigma_{name}": own[f"sigma_{name}"] for name in NAMES}
    for column in ("accepted", "nse", *(f"error_{name}" for name in NAMES)):
        row |= {column: own[column], f"{column}_by_twin": by_twin[column]}
    return row


def main() -> None:
    """Calibrate the sessions, write their rows and print the differences."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=50, help="number of sessions; default: 50")
    parser.add_argument("--jobs", type=int, default=2, help="number of worker processes; default: 2")
    parser.add_argument("--resume", action="store_true", help="continue an interrupted campaign of the same program")
    options = parser.parse_args()
    path, numbers = FOLDER / "labels.parquet", range(options.sessions)
    rows = collect_rows(path, row_of, numbers, options.jobs, options.resume, TASKS_OF_A_WORKER)
    accepted, by_twin = rows["accepted"].sum(), rows["accepted_by_twin"].sum()
    print(f"{len(rows)} sessions; accepted: {accepted}, by the twins' labels: {by_twin}")
    nse, by_twin = rows["nse"].mean(), rows["nse_by_twin"].mean()
    print(f"mean normalised squared error: {nse:.2f}, by the twins' labels: {by_twin:.2f}")
    for name in NAMES:
        moved = (rows[f"error_{name}"] - rows[f"error_{name}_by_twin"]) / rows[f"sigma_{name}"]
        print(f"{name:>6}: moved by {np.sqrt(np.mean(moved**2)):.3f} sigmas RMS, {moved.abs().max():.3f} at most")


if __name__ == "__main__":
    main()
