"""What would explain the residuals: parameters of all points, and parts of the points, in one list by their strength.

A parameter's strength is the root of the fall of the least sum of squares if nothing is known of it beforehand; that of
a set of parameters is the normal deviate as improbable as their common fall
(:mod:`~pipeline.maths.adjustment.joint_tests`). That of a pass, face, step, height or ping is its mean over the sigma
of this mean (:mod:`~pipeline.report.residual_tests`). All are against the same null hypothesis: fixed parameters are as
the settings say, estimated ones within their a-priori sigmas. (One exception: where a parameter or set explains more
than any drift of the INS that is larger than stated, parameters and sets count with the drift as stated, parts of the
points with the larger one, which takes strength from them.) The alternative with the largest is the most likely one
(Baarda 1968, "A testing procedure for use in geodetic networks"; for alternatives of different kinds Teunissen 2018,
"Distributional theory for the DIA method", 3.2). The sigma of a mean comes from its scatter, that of a parameter from
the model: degrees of freedom of a sigma are not counted, because a large ratio over few of them would then be named too
late.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from pipeline.report.residual_tests import DeviatingPart
from pipeline.report.suspected_causes import SuspectedCause

PART_WORDS = {
    "pass": "pass {}",
    "face": "face {}",
    "step": "a step of the fan at {}°",
    "height": "a step on a face, {} m above the water (-: below)",
    "ping": "one ping of {}",
    "drift": "the INS in pass {}",
}


@dataclass(frozen=True)
class Hypothesis:
    """One explanation of the residuals.

    Attributes
    ----------
    kind : parameter, set (of parameters), pass, face, step, height, ping or drift
    name : of the parameter, set or face; number of the pass; angle or height of the step; length of the cycle of pings
    sigmas : its strength
    words : for people
    """

    kind: str
    name: str
    sigmas: float
    words: str


def hypotheses(parts: Sequence[DeviatingPart], causes: Sequence[SuspectedCause]) -> list[Hypothesis]:
    """Return all explanations, the strongest first.

    Parameters
    ----------
    parts : deviating parts of the points
    causes : suspected causes
    """
    found = [
        Hypothesis("set" if cause.is_set else "parameter", cause.name, cause.strength, cause.words) for cause in causes
    ]
    for part in parts:
        found.append(Hypothesis(part.kind, part.name, part.strength, PART_WORDS[part.kind].format(part.name)))
    return sorted(found, key=lambda hypothesis: -hypothesis.sigmas)


def hypotheses_block(found: Sequence[Hypothesis]) -> list[dict[str, Any]]:
    """Return the block ``hypotheses`` of calibration.json."""
    return [asdict(hypothesis) for hypothesis in found]
