"""A recording of a plan: the target's faces coloured by the soundings predicted on them, and the tracks."""

from pathlib import Path
from typing import Any

import numpy as np

from pipeline.atomic_files import write_bytes
from pipeline.planning.assessment import Accuracy, PlanAssessment
from pipeline.planning.prediction import planned_track
from pipeline.results.pages.families import styles_of_families
from stages.views.recording import COLOURS, GREY, LASER, SONAR, recording_content, text_document

PLENTY = 1000  # from this number of soundings on, a face has the full colour


def save_plan(answer: PlanAssessment, said: str, path: Path) -> None:
    """Write a recording of a plan to ``path``; ``said``: the text that is printed on the screen."""
    import rerun.blueprint as rrb

    def draw(recording: Any) -> None:
        _target(recording, answer)
        _list(recording, answer, "given", answer.given)
        if answer.better is not None:
            _list(recording, answer, "better", answer.better)
        recording.log("tables/plan", text_document(said), static=True)

    views = [rrb.Spatial3DView(origin="/", name="Target and tracks"), rrb.TextDocumentView(origin="tables/plan")]
    write_bytes(path, recording_content("plan", rrb.Blueprint(rrb.Horizontal(*views, column_shares=[3, 2])), draw))


def _target(recording: Any, answer: PlanAssessment) -> None:
    import rerun as rr

    colours = styles_of_families([family.name for family in answer.setting.model.families], COLOURS)
    for face in answer.setting.model.faces:
        outline = np.vstack([face.vertices_m, face.vertices_m[:1]]).astype(np.float32)
        strip = rr.LineStrips3D([outline], radii=0.008, colors=colours[face.family])
        recording.log(f"target/{face.name}", strip, static=True)


def _list(recording: Any, answer: PlanAssessment, name: str, outlook: Accuracy) -> None:
    """Log the faces, coloured by their number of soundings in all passes, and the track of each pass."""
    import rerun as rr

    total = np.sum([points["mbes"] for points in outlook.predicted.points], axis=0)
    for face, count in zip(answer.setting.model.faces, total.tolist(), strict=True):
        if not count:
            continue
        share = min(1.0, count / PLENTY)
        colour = [round(grey + share * (full - grey)) for grey, full in zip(GREY, SONAR, strict=True)]
        fan = [(0, k, k + 1) for k in range(1, len(face.vertices_m) - 1)]
        colours = [colour] * len(face.vertices_m)
        mesh = rr.Mesh3D(vertex_positions=face.vertices_m, triangle_indices=fan, vertex_colors=colours)
        recording.log(f"{name}/faces/{face.name}", mesh, rr.AnyValues(soundings=round(count)), static=True)
    for number, sailed in enumerate(outlook.passes):
        line = planned_track(answer.setting, sailed, number)[::10].astype(np.float32)
        strip = rr.LineStrips3D([line], radii=0.02, colors=LASER, labels=[f"{sailed.distance_m:g} m"])
        recording.log(f"{name}/tracks/{number}", strip, static=True)
