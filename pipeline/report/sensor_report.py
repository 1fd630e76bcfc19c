"""The parts of a report that depend on which sensor is calibrated."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from pipeline.config.pool import Method
from pipeline.config.session import Laser, Mbes
from pipeline.mount import Mounted
from pipeline.report.ambiguities import MountSearch
from pipeline.report.method_blocks import Block
from pipeline.report.reason_codes import Statement


@dataclass(frozen=True, kw_only=True)
class SensorReport:
    """Parts of a report that differ between a calibration of the sonar and one of the laser.

    Attributes
    ----------
    coarse : coarse mount of the calibrated sensor
    methods : blocks of calibration.json by method; the adjustment is always among them
    method : the method that is the result
    search : the search for its provisional mount
    held : mount parameters of a laser that are not good enough
    sides : name of the setting of the target's left and right, in words
    advice : weaknesses of the geometry and their remedy, in words
    result_keys : keys of calibration.json that follow ``result``
    data_keys : keys of calibration.json that follow ``passes``
    instruments : settings of the sonar, by sensor, for the block ``instruments``; empty for the laser
    pass_warnings, cast_warnings : warnings of a calibration of the sonar; empty for the laser
    closing : table of the plane agreement; None for the laser
    """

    coarse: Mounted
    methods: Mapping[str, Block]
    method: Method
    search: MountSearch
    sides: str
    advice: str
    result_keys: Mapping[str, Any]
    held: Collection[str] = ()
    data_keys: Mapping[str, Any] = field(default_factory=dict)
    instruments: Mapping[str, Laser | Mbes] = field(default_factory=dict)
    pass_warnings: tuple[Statement, ...] = ()
    cast_warnings: tuple[Statement, ...] = ()
    closing: pd.DataFrame | None = None
