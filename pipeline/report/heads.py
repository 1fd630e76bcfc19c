"""The report of a session with several heads: the evidence of each, and their blocks of calibration.json.

The heads are adjusted together. What the tests say of all points, of the INS and of the target is said once. Each head
has its own labels, methods, limits and warnings. Tables of the adjustment hold a further head's parameters under names
that begin with the head's; here they are cut out and named as those of a single sonar.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any

import numpy as np
import pandas as pd

from pipeline.artefacts.catalogue.patent import CORRECTIONS
from pipeline.artefacts.catalogue.points import FILES, UNSOUNDED_PASSES
from pipeline.artefacts.catalogue.results import HEAD_EFFECTS
from pipeline.artefacts.catalogue.target import PLANES, PROVISIONAL_MOUNT, SEGMENT_COUNTS, SOUNDING_MOMENTS, TARGET_POSE
from pipeline.artefacts.counts import used
from pipeline.artefacts.schema import OfFurtherHeads
from pipeline.maths.adjustment.parameters import of_head
from pipeline.maths.mount_parameters import MOUNT_NAMES, N_MOUNT
from pipeline.report.calibration_document import statement_lists
from pipeline.report.evidence import Evidence
from pipeline.report.label_checks import unsettled_labels
from pipeline.report.method_blocks import calibration_table
from pipeline.report.noise_warnings import sigmas_too_small
from pipeline.report.reason_codes import ReasonCode, Statement, named
from pipeline.report.sensor_report import SensorReport
from pipeline.report.verdict import Criteria, JudgedHead, own_reasons

Tables = Mapping[str, pd.DataFrame]  # by head
FIRST = "mbes"
MOST_OUTSIDE = 0.01  # share of a head's labelled soundings outside the passes: pings before and after them


@dataclass(frozen=True, kw_only=True)
class OfHeads:
    """Tables of the further heads' own runs, by head; each stands in place of the field without ``further_``."""

    further_files: Annotated[Tables, OfFurtherHeads(FILES)]
    further_unsounded_passes: Annotated[Tables, OfFurtherHeads(UNSOUNDED_PASSES)]
    further_planes: Annotated[Tables, OfFurtherHeads(PLANES)]
    further_sounding_moments: Annotated[Tables, OfFurtherHeads(SOUNDING_MOMENTS)]
    further_target_pose: Annotated[Tables, OfFurtherHeads(TARGET_POSE)]
    further_provisional_mount: Annotated[Tables, OfFurtherHeads(PROVISIONAL_MOUNT)]
    further_corrections: Annotated[Tables, OfFurtherHeads(CORRECTIONS)]
    counts_of_heads: Annotated[Tables, OfFurtherHeads(SEGMENT_COUNTS)]
    head_effects: Annotated[pd.DataFrame | None, HEAD_EFFECTS] = None


@dataclass(frozen=True, kw_only=True)
class HeadReport:
    """A head of the sonar as the report has it: ``reasons`` are about it alone; ``systematic`` is that key."""

    judged: JudgedHead
    report: SensorReport
    reasons: Sequence[Statement]
    systematic: Mapping[str, Any]

    @property
    def block(self) -> dict[str, Any]:
        """The head's block of calibration.json."""
        return {
            "name": self.judged.name,
            **self.report.methods[self.report.method],
            "verdict": "rejected" if self.reasons else "accepted",
            **statement_lists("reason", self.reasons),
            "coarse": {"mount": self.report.coarse.settings()},
            "methods": self.report.methods,
            **self.systematic,
        }

    def warnings(self, level: float) -> list[Statement]:
        """Return the warnings that are about this head alone, with its name; ``level``: of the tests."""
        evidence = self.judged.evidence
        found = [
            *unsettled_labels(float(evidence.provisional_mount["label_change"].iloc[0])),
            *sigmas_too_small(evidence.estimate, level),
            *self.report.pass_warnings,
            *self.report.cast_warnings,
        ]
        return named(self.judged.name, found)

    @property
    def calibration(self) -> pd.DataFrame:
        """The rows of table calibration, with the head's name behind the method."""
        return self._named(calibration_table(self.report.methods, self.report.coarse), "method")

    @property
    def closing(self) -> pd.DataFrame:
        """The rows of table closing, with the head's name behind the mount."""
        assert self.report.closing is not None
        return self._named(self.report.closing, "mount")

    def _named(self, table: pd.DataFrame, column: str) -> pd.DataFrame:
        return table.assign(**{column: table[column] + f" ({self.judged.name})"})


def head_report(
    name: str, evidence: Evidence, report: SensorReport, criteria: Criteria, systematic: Mapping[str, Any]
) -> HeadReport:
    """Return the report on one head.

    Parameters
    ----------
    name : name of the head
    evidence : the evidence, with this head's tables
    report : the parts of the report that depend on the head
    criteria : limits of the verdict, and words for its reasons
    systematic : the key ``systematic`` of calibration.json, for this head
    """
    judged = JudgedHead(name=name, evidence=evidence, methods=report.methods, criteria=criteria)
    return HeadReport(judged=judged, report=report, reasons=own_reasons(judged), systematic=systematic)


def evidence_of(evidence: Evidence, of_heads: OfHeads, head: str) -> Evidence:
    """Return the evidence with one head's tables, whose parameters have the names of a single sonar's.

    Parameters
    ----------
    evidence : tables of the run
    of_heads : tables of the further heads
    head : name of the head, the first one or a further one
    """
    prefix = "" if head == FIRST else f"{head}_"
    names = {f"{prefix}{name}": name for name in MOUNT_NAMES}
    covariance = evidence.covariance
    inside = covariance["row"].isin(names) & covariance["column"].isin(names)
    own_covariance = covariance[inside].replace({"row": names, "column": names}).reset_index(drop=True)
    estimate = evidence.estimate
    of_mounts = estimate["unknown"].map(lambda name: of_head(name)[1] in MOUNT_NAMES)
    kept = estimate[~of_mounts | estimate["unknown"].isin(names)]
    own_estimate = kept.replace({"unknown": names}).reset_index(drop=True)
    own = {} if head == FIRST else _own_tables(of_heads, head)
    if head != FIRST:
        own["geometry"] = evidence.geometry.iloc[:0]  # it is about the first head
        assert of_heads.head_effects is not None
        effects = of_heads.head_effects[of_heads.head_effects["head"] == head].set_index("unknown").drop(columns="head")
        own["freed"] = evidence.freed.assign(**effects.loc[evidence.freed["unknown"]].reset_index(drop=True))
    return replace(evidence, estimate=own_estimate, covariance=own_covariance, **own)


def _own_tables(of_heads: OfHeads, head: str) -> dict[str, pd.DataFrame]:
    names = [one.name for one in fields(OfHeads) if one.name.startswith("further_")]
    return {name.removeprefix("further_"): getattr(of_heads, name)[head] for name in names}


def outside_passes(cells: pd.DataFrame, counts_of_heads: Tables) -> list[Statement]:
    """Return a warning for each further head of whose labelled soundings many lie outside the first head's passes.

    Parameters
    ----------
    cells : the table, which has all labelled soundings in these passes
    counts_of_heads : table ``counts`` of stage segment, by further head
    """
    warnings = []
    for head, counts in counts_of_heads.items():
        labelled, inside = int(used(counts, "soundings_pool")), int(cells.loc[cells["sensor"] == head, "count"].sum())
        if labelled - inside > MOST_OUTSIDE * labelled:
            words = (
                f"{head}: {labelled - inside:,} of its {labelled:,} soundings on the target lie outside the passes of "
                "the first head, and are not used"
            )
            warnings.append(Statement(ReasonCode.SOUNDINGS_OUTSIDE_PASSES, words))
    return warnings


def heads_keys(first: HeadReport, further: Sequence[HeadReport], covariance: pd.DataFrame) -> dict[str, Any]:
    """Return the keys ``heads`` and ``heads_covariance`` of calibration.json; none of a sonar with one head.

    Parameters
    ----------
    first, further : the heads
    covariance : table of the covariance of all mounts
    """
    if not further:
        return {}
    heads = [first, *further]
    return {
        "heads": [head.block for head in heads],
        "heads_covariance": {
            "heads": [head.judged.name for head in heads],
            "covariance": _matrix(covariance["covariance"], N_MOUNT * len(heads)),
            "covariance_total": _matrix(covariance["covariance_total"], N_MOUNT * len(heads)),
        },
    }


def _matrix(values: pd.Series, size: int) -> list[list[float]] | None:
    matrix = values.to_numpy(np.float64).reshape(size, size)
    return matrix.tolist() if np.all(np.isfinite(matrix)) else None
