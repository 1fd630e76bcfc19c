"""One plain sentence on each mount parameter: how well it is known, what limits it, and what would make it better."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.error_sources import ERROR_SOURCES, OWNERS
from pipeline.maths.mount_parameters import MOUNT_WORDS, PARAMETERS
from pipeline.mount import WITHIN_95
from pipeline.report.sigma_sources import NOISE
from pipeline.results.pages.mount_tables import Quantity

NOISE_LIMITS = ("the noise of the sensors and the INS", "more passes make it smaller")
ROUGH_LIMITS = (NOISE_LIMITS[0], "every pass sees a rough wall's bumps again; more walls make it smaller")
CAUSES = {  # by the beginning of the parameters' names (ERROR_SOURCES): the source in a sentence, and the remedy
    "laser_rotation": ("the angles of the laser's own mount", "calibrate the laser better (poolcal laser)"),
    "laser_lever_arm": ("the lever arm of the laser's own mount", "calibrate the laser better, or survey it again"),
    "laser_range": ("an error that all ranges of the laser may share", "check it against a measured distance"),
    "laser_latency": ("the laser's clock", "measure the delay of its time stamps"),
    "laser_incidence": ("how the laser sees slanted faces", "make the dry faces dull, and keep them dry"),
    "mbes_incidence": ("how the sonar hears slanted faces", "clean the wet faces, and check the bottom detection"),
    "mbes_level_range": ("how the sonar hears horizontal faces", "check the bottom detection there"),
    "projector": ("the place of the transmitter in the sonar's head", "measure it, or ask its maker"),
    "steering_speed": ("the sound speed at the arrays", "measure it at the head"),
    "mbes_range": ("an error that all ranges of the sonar may share", "check it against a measured distance"),
    "mbes_latency": ("the sonar's clock", "measure the delay of its time stamps"),
    "sound_speed_gradient": ("how the sound speed may change with depth", "take a cast through the whole depth"),
    "sound_speed": ("the sound speed", "measure it with a calibrated probe"),
    "wet": ("how the wet faces may stand against the dry ones", "survey them below the water"),
    "face_": ("how far single faces may stand off the design", "survey them, and give them in as_built.faces"),
    "surfaces_": ("how the target may differ from its design", "survey the target"),
    "rotation": ("the coarse mount", "sail passes that tell more, or survey the mount better"),
    "lever_arm": ("the coarse mount", "sail passes that tell more, or survey the mount better"),
}
IN_WORDS = {NOISE: NOISE_LIMITS, OWNERS["laser_mount"]: ("the laser's own mount", "calibrate the laser better")} | {
    source.words: CAUSES[source.beginning] for source in ERROR_SOURCES
}
MOST = 0.5  # share of the square of the total sigma from which on a source makes most of it


def limiting_sentences(
    sources: Mapping[str, NDArray[np.float64]], parameters: Sequence[Mapping[str, Any]], rough: bool = False
) -> Iterator[str]:
    """Yield a sentence for each mount parameter with a total sigma.

    Parameters
    ----------
    sources
        Contributions (6,) of the sources to the total sigmas, by their words
        (:func:`~pipeline.report.sigma_sources.contributions`).
    parameters
        Rows of :func:`~pipeline.results.pages.mount_tables.parameter_rows`.
    rough
        Whether walls are rough: their bumps are in the noise.
    """
    for row, (_, place, _, unit) in zip(parameters, PARAMETERS, strict=True):
        if not (sources and row["sigma_total"].known):
            continue
        squares = {words: float(of_source[place]) ** 2 for words, of_source in sources.items()}
        largest = max(squares, key=lambda words: squares[words])
        source, remedy = ROUGH_LIMITS if rough and largest == NOISE else IN_WORDS[largest]
        half_width = Quantity(WITHIN_95 * row["sigma_total"].number, unit).small()
        name = MOUNT_WORDS[place]
        known = f"{name[0].upper()}{name[1:]} is known to ±{half_width} (95 %)"
        if squares[largest] >= MOST * sum(squares.values()):
            yield f"{known}; most of that comes from {source}: {remedy}"
        else:
            yield f"{known}; the largest part of that comes from {source}: {remedy}"
