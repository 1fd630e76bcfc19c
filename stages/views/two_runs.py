"""Two runs in one recording: the first under /a, the second under /b, and under /both with the mount of the first."""

from pathlib import Path
from typing import Any

import numpy as np

from pipeline.artefacts.catalogue.points import POSES
from pipeline.artefacts.catalogue.target import SOUNDINGS_LABELLED, TARGET_POSE
from pipeline.artefacts.from_tables import trajectory_in_target
from pipeline.artefacts.streams import point_array
from pipeline.atomic_files import write_bytes
from pipeline.results.diff_text import difference_text
from pipeline.run.results import Tables, calibration
from stages.views.blueprint import two_runs_blueprint
from stages.views.recording import DOT_M, LASER, SONAR, log_stage, recording_content, recording_id, text_document

SOUNDINGS = 200_000  # most soundings of each run under /both
STAGES = ("segment", "fit_planes", "angle_iterate", "offsets", "adjust", "report")  # with entities in the target frame


class NestedRecording:
    """A recording stream with every entity one level deeper, under ``name``."""

    def __init__(self, recording: Any, name: str) -> None:
        self._recording, self._name = recording, name

    def log(self, path: str, *parts: Any, **options: Any) -> None:
        """Log parts of an entity, as rerun.RecordingStream.log does."""
        self._recording.log(f"{self._name}/{path}", *parts, **options)

    def send_columns(self, path: str, **columns: Any) -> None:
        """Log columns of an entity, as rerun.RecordingStream.send_columns does."""
        self._recording.send_columns(f"{self._name}/{path}", **columns)

    def set_time(self, timeline: str, **at: Any) -> None:
        """Set the time of the entities that are logged next, as rerun.RecordingStream.set_time does."""
        self._recording.set_time(timeline, **at)


def save_two_runs(first: Path, second: Path, difference: dict[str, Any], path: Path) -> None:
    """Write a recording of two runs.

    Parameters
    ----------
    first, second
        The run folders.
    difference
        Their difference, of :func:`pipeline.results.diff.run_difference`.
    path
        The recording's file.
    """

    def draw(recording: Any) -> None:
        for name, run in (("a", first), ("b", second)):
            for stage in STAGES:
                log_stage(NestedRecording(recording, name), stage, Tables(run))
        _on_one_target(recording, Tables(first), Tables(second))
        recording.log("tables/comparison", text_document(difference_text(difference)), static=True)

    write_bytes(path, recording_content(recording_id(first, second), two_runs_blueprint(), draw))


def _on_one_target(recording: Any, first: Tables, second: Tables) -> None:
    """Log the soundings of both runs with the first run's mount. If the sonar has moved, the second's lie off."""
    import rerun as rr

    block = calibration(first.run)["mbes"]
    if block["mount"] is None:
        return
    rotation, lever_arm = np.array(block["R_body_from_mbes"]), np.array(block["lever_arm_m"])
    for name, tables, colour in (("a", first, LASER), ("b", second, SONAR)):
        axes = [f"{axis}_mbes_m" for axis in "xyz"]
        columns, step = tables.sample(SOUNDINGS_LABELLED, SOUNDINGS, "t_ns", *axes)
        trajectory = trajectory_in_target(tables.table(POSES), tables.table(TARGET_POSE))
        positions, R_target_from_body = trajectory.poses_at(columns["t_ns"].astype(np.int64))
        body = point_array(columns, "mbes_m") @ rotation.T + lever_arm
        points = (positions + np.einsum("nij,nj->ni", R_target_from_body, body)).astype(np.float32)
        cloud = rr.Points3D(points, radii=DOT_M, colors=colour)
        recording.log(f"both/{name}", cloud, rr.AnyValues(one_in=step), static=True)
