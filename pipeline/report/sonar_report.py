"""The parts of the report that only a calibration of the sonar has."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from pipeline.artefacts.from_tables import rotation_vector_deg
from pipeline.config.mount import Mount
from pipeline.config.pool import Method, Segment
from pipeline.config.session import Mbes
from pipeline.mount import Mounted, corrected_mount, mount_of
from pipeline.report.ambiguities import MountSearch
from pipeline.report.cast_checks import cast_warnings, describe_cast
from pipeline.report.evidence import Evidence
from pipeline.report.method_blocks import Block, adjustment_block, mounted_of, patent_blocks
from pipeline.report.plane_agreement import lifted_moments_by_family, plane_agreement_table
from pipeline.report.sensor_report import SensorReport
from pipeline.report.warnings import passes_with_one_sensor, passes_without_files


@dataclass(frozen=True, kw_only=True)
class SonarSettings:
    """Settings of a sonar's report.

    Attributes
    ----------
    mbes : settings of the sonar
    segment : limits of the search for its provisional mount
    method : the method that is to be the result
    sides : name of the setting of the target's left and right, in words
    """

    mbes: Mbes
    segment: Segment
    method: Method
    sides: str


def sonar_report(settings: SonarSettings, evidence: Evidence, passes: Sequence[Mapping[str, Any]]) -> SensorReport:
    """Return the sonar's parts of a report.

    Parameters
    ----------
    settings : settings of the sonar and of its search
    evidence : tables of the run
    passes : rows of the key ``passes`` of calibration.json
    """
    mbes, method = settings.mbes, settings.method
    coarse = mount_of(mbes.mount)
    methods = {} if evidence.corrections is None else patent_blocks(evidence.corrections, coarse)
    methods["adjustment"] = adjustment_block(evidence.estimate, evidence.covariance, evidence.summary, coarse)
    max_angle_deg, max_lever_arm_m = settings.segment.farthest_mount
    return SensorReport(
        coarse=coarse,
        methods=methods,
        method=method,
        search=MountSearch(
            sensor="mbes",
            max_angle_deg=max_angle_deg,
            max_lever_arm_m=max_lever_arm_m,
            angles_advice=_angles_advice(mbes.mount, evidence.provisional_mount.iloc[0]),
        ),
        sides=settings.sides,
        advice="; ".join(evidence.geometry["words"]),
        result_keys={"mbes": methods[method], "methods": methods},
        data_keys={"ranges": _range_note(mbes)} | _cast_block(mbes),
        instruments={"mbes": mbes},
        pass_warnings=(*passes_without_files(evidence.unsounded_passes), *passes_with_one_sensor(passes)),
        cast_warnings=tuple(cast_warnings(mbes, evidence.files, methods["adjustment"]["correction"])),
        closing=_closing(evidence, coarse, methods),
    )


def _angles_advice(coarse: Mount, provisional: pd.Series) -> str:
    """Return the advice to enter the angles of the provisional mount, if the signs have been checked."""
    settings = corrected_mount(coarse, rotation_vector_deg(provisional)).settings()
    values = ", ".join(f"{key} {settings[key]:.1f}" for key in ("roll_deg", "pitch_deg", "yaw_deg"))
    return f"; if you have checked the signs, enter {values} as mbes.mount and run again"


def _range_note(mbes: Mbes) -> str:
    """Return in words how ranges were reduced, and whether rays were traced."""
    note = "sonar ranges taken as recorded: half the two-way path"
    if mbes.projector_offset_m is not None:
        note = f"sonar ranges reduced for a transmitter at {list(mbes.projector_offset_m)} m in the mbes frame"
    if mbes.svp is None:
        return note
    note = f"{note}; rays traced through a cast of {len(mbes.svp)} depths"
    return note if mbes.svp_from is None else f"{note} (mbes.svp {describe_cast(mbes.svp_from)})"


def _cast_block(mbes: Mbes) -> dict[str, Any]:
    """Return the block ``cast`` of calibration.json; empty without a cast."""
    if mbes.svp is None:
        return {}
    source = {} if mbes.svp_from is None else mbes.svp_from.model_dump(mode="json")
    return {"cast": {"depths": len(mbes.svp), "sigma_m_s": mbes.svp_sigma_m_s} | source}


def _closing(evidence: Evidence, coarse: Mounted, methods: Mapping[str, Block]) -> pd.DataFrame:
    """Return table ``closing``: the plane agreement with the coarse mount and with each method that has a result."""
    mounts = {"coarse": coarse} | {name: mounted_of(block) for name, block in methods.items() if block["mount"]}
    moments = lifted_moments_by_family(evidence.faces, evidence.sounding_moments)
    return plane_agreement_table(evidence.planes, moments, coarse, mounts)
