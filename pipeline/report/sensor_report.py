"""The parts of a report that depend on which sensor is calibrated."""

from collections.abc import Mapping
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
    """What a report says of the calibrated sensor alone.

    Attributes
    ----------
    coarse : its mount as configured
    methods : blocks of calibration.json by method; the adjustment is always among them
    method : the method that is the result
    search : how its provisional mount was searched
    sides : the setting that tells the target's left from its right, for people
    advice : what would make the geometry better, for people
    result_keys : keys of calibration.json that follow ``result``
    data_keys : keys of calibration.json that follow ``passes``
    instruments : settings of its own whose preset is named, by sensor
    pass_warnings, cast_warnings : warnings that the other sensor's calibration does not have
    closing : table of the planes' agreement, where there are two sensors
    """

    coarse: Mounted
    methods: Mapping[str, Block]
    method: Method
    search: MountSearch
    sides: str
    advice: str
    result_keys: Mapping[str, Any]
    data_keys: Mapping[str, Any] = field(default_factory=dict)
    instruments: Mapping[str, Laser | Mbes] = field(default_factory=dict)
    pass_warnings: tuple[Statement, ...] = ()
    cast_warnings: tuple[Statement, ...] = ()
    closing: pd.DataFrame | None = None
