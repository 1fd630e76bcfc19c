"""A changed setting runs only the stages that use it, and those after them (whole runs: test_repeats.py)."""

import pytest

import pipeline.run.runner
from pipeline.errors import PoolcalError
from stages import ORDER
from tests.support.places import Place

FIRST_STAGE: dict[str, tuple[object, str]] = {  # by key: another value, and the first stage that uses it
    "mbes.latency_s": (0.002, "ingest"),
    "mbes.sound_speed_m_s": (1481.0, "georeference"),
    "mbes.svp": ([[0.1, 1480.0], [3.9, 1482.0]], "georeference"),
    "mbes.projector_offset_m": ([0.0, 0.1, 0.0], "georeference"),
    "mbes.mount": ({"x_m": 0.37}, "georeference"),
    "laser.mount": ({"x_m": 0.37}, "georeference"),
    "mbes.beam_deg": ([0.6, 1.1], "segment"),
    "mbes.focused": ([True, False], "segment"),
    "mbes.angle_sigma_deg": (0.07, "segment"),
    "mbes.range_sigma_m": (0.009, "segment"),
    "mbes.range_bias_sigma_m": (0.003, "adjust"),
    "mbes.projector_sigma_m": (0.004, "adjust"),
    "mbes.sound_speed_sigma_m_s": (0.3, "adjust"),
    "mbes.sound_speed_gradient_sigma_1_s": (0.2, "adjust"),
    "mbes.latency_sigma_s": (0.0006, "adjust"),
    "laser.range_sigma_m": (0.006, "segment"),
    "laser.angle_sigma_deg": (0.004, "segment"),
    "laser.beam_m": (0.02, "segment"),
    "laser.mount_sigma": ({"angle_deg": 0.006}, "adjust"),
    "ins.white": ({"position_m": 0.003}, "segment"),
    "ins.drift_within": ({"sigmas": 3.0}, "adjust"),
}


@pytest.mark.parametrize("key", FIRST_STAGE)
def test_the_first_stage_that_runs_again(done: Place, key: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stages before it are up to date. It is named with its reason, and what follows from it is not waited for."""

    def stop(_: object, stage: object) -> None:
        raise PoolcalError(f"would run {stage.__name__}")

    monkeypatch.setattr(pipeline.run.runner, "execute_stage", stop)
    value, first = FIRST_STAGE[key]
    sensor, name = key.split(".")
    done.edit_session(sensor, **{name: value})
    *before, reason, last = done.calibrate().err.splitlines()
    assert before == [f"{stage}: up to date" for stage in ORDER[: ORDER.index(first)]]
    assert reason.startswith(f"{first}: ")
    assert key in reason
    assert " -> " in reason
    assert last == f"poolcal: would run stages.{first}"
