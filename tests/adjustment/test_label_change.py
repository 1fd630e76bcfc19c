"""The share of labels that an adjustment of the sample has changed."""

import numpy as np
import pytest

from pipeline.adjustment.provisional import label_change
from pipeline.artefacts.streams import MemoryPart, Stream


def labels(faces: list[int], weights: list[float], first: int = 0) -> Stream:
    """Return labelled soundings of one ping, from this beam on."""
    columns = {
        "t_ns": np.full(len(faces), 5, dtype=np.int64),
        "beam": np.arange(first, first + len(faces), dtype=np.int16),
        "face": np.array(faces, dtype=np.int16),
        "edge_weight": np.array(weights, dtype=np.float32),
    }
    return Stream((MemoryPart("soundings_labelled", columns),))


@pytest.mark.parametrize(
    ("after", "change"),
    [
        (labels([0, 0, 1, 1], [1.0, 1.0, 0.5, 1.0]), 0.0),
        (labels([0, 0, 1, 1], [1.0, 1.0, 0.75, 1.0]), 0.25 / 3.75),  # nearer to an edge
        (labels([0, 0, 1], [1.0, 1.0, 0.5]), 1.0 / 2.5),  # without a label
        (labels([0, 1, 1, 1], [1.0, 1.0, 0.5, 1.0]), 2.0 / 3.5),  # on another face
        (labels([0, 0, 1, 1], [1.0, 1.0, 0.5, 1.0], first=9), 2.0),  # other beams altogether
    ],
)
def test_label_change_is_the_share_of_weights_that_differ(after: Stream, change: float) -> None:
    assert label_change(labels([0, 0, 1, 1], [1.0, 1.0, 0.5, 1.0]), after) == pytest.approx(change)
