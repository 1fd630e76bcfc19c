"""poolcal with toy stages: python toy_poolcal.py ARGUMENTS. verdict.max_sigma_m sets what the toy report does:
1: accepted, 2: rejected, 3: a bug, 4: Ctrl-C, 5: hangs, 6: crashes.
"""

import importlib
import os
import signal
import sys
import time
import types
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

sys.path.insert(0, str(Path(__file__).parents[2]))

import pandas as pd

import pipeline.readers.dispatch
import pipeline.results.pages.assumptions
import pipeline.results.screen
import stages
import stages.commands.draw
from pipeline.artefacts.catalogue.results import CALIBRATION_JSON
from pipeline.artefacts.schema import Provenance
from pipeline.config.verdict import VerdictLimits
from tests.support import toys

REPEAT_WORKER = "as-a-worker-of-poolcal-repeat"


@dataclass(frozen=True)
class Config:
    verdict: VerdictLimits
    name: str


@dataclass(frozen=True)
class Inputs:
    means: Annotated[pd.DataFrame, toys.MEANS]
    provenance: Annotated[dict[str, Any], Provenance]


@dataclass(frozen=True)
class Outputs:
    calibration_json: Annotated[str, CALIBRATION_JSON]


def _run(inputs: Inputs, config: Config) -> Outputs:
    import json

    code = round(config.verdict.max_sigma_m or 0)
    if code == 3:
        raise ZeroDivisionError("a toy bug")
    if code == 6:
        os.kill(os.getpid(), signal.SIGSEGV)
    if code == 4:
        os.kill(os.getpid(), signal.SIGINT)
    if code in (4, 5):
        time.sleep(30)
    result = {
        "schema": 1, "session": config.name, "verdict": "rejected" if code == 2 else "accepted",
        "reasons": ["toy"] if code == 2 else [], "inputs": inputs.provenance["inputs"],
        "software": inputs.provenance["software"], "mbes": {"mount": None},
    }  # fmt: skip
    return Outputs(json.dumps(result) + "\n")


def install(put: Callable[[object, str, object], object], repeat: bool = True) -> dict[str, types.ModuleType]:
    """Put the toys in the place of what they replace; the modules that ``sys.modules`` must hold are returned.

    Without ``repeat`` the command of that name has none: it imports matplotlib, half of the time of a start.
    """
    report = types.ModuleType("stages.report")
    report.__file__ = __file__
    vars(report).update(Config=Config, Inputs=Inputs, Outputs=Outputs, run=_run)
    put(stages.commands.draw, "draw_missing", lambda *_: [])  # toys have nothing to show
    put(
        pipeline.results.screen, "summary",
        lambda calibration: f"{calibration['session']}: {calibration['verdict']}",
    )  # fmt: skip
    put(pipeline.results.pages.assumptions, "note_of_run", lambda *_: "")  # nor an INS
    take, sift, _ = toys.stages()
    take.__name__, sift.__name__ = "stages.take", "stages.sift"
    put(stages, "ORDER", ("take", "sift", "report"))
    put(pipeline.readers.dispatch, "raw_files", toys.raw_files)
    put(pipeline.readers.dispatch, "raw_parts", toys.raw_parts)
    run = importlib.import_module("stages.commands.run")  # not before the toys are in their places
    put(run, "say_next", lambda *_: None)  # toys have no values to enter
    if repeat:
        worker = [sys.executable, __file__, REPEAT_WORKER]
        put(importlib.import_module("stages.commands.repeat"), "WORKER", worker)
    return {module.__name__: module for module in (take, sift, report)}


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # as in a terminal: a job in the background ignores it
    sys.modules |= install(setattr, repeat=sys.argv[1] == "repeat")
    if sys.argv[1] == REPEAT_WORKER:
        from stages.commands.repeat_worker import main
    else:
        from stages.cli import main
    main()
