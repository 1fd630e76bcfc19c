"""What INS logs and accuracy files say of their own accuracy: whose, when, in which units, and what is left out."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.errors import PoolcalError, RawDataError
from pipeline.readers.dispatch import raw_files, raw_parts
from tests.support.files import build
from tests.support.files.build import (
    ALIGNING,
    SIGMAS,
    WEEK,
    inspvas,
    inspvax,
    insstdev,
    insstdeva,
    insstdevs,
    read,
    sbet,
    smrmsg,
)

NS = 1_000_000_000
WEEK_NS = 604_800 * NS
NAMES = ("north_m", "east_m", "up_m", "roll_deg", "pitch_deg", "heading_deg")
TOLD = SIGMAS[:3] + SIGMAS[6:]


def told(folder: Path, kind: str, **more: Any) -> tuple[dict[str, np.ndarray], dict[str, int]]:
    """All sigmas of the session's INS files, and all that was left out."""
    settings = build.settings("ins", more.pop("files", ["*"]), kind, **more)
    chunks = [chunk for part in raw_parts("ins", settings, folder) for chunk in part.chunks()]
    dropped: dict[str, int] = {}
    for chunk in chunks:
        for reason, number in chunk.dropped.items():
            dropped[reason] = dropped.get(reason, 0) + number
    some = [chunk.sigmas for chunk in chunks if chunk.sigmas]
    return {name: np.concatenate([one[name] for one in some]) for name in (some[0] if some else ())}, dropped


def is_told(sigmas: dict[str, np.ndarray], seconds: list[float], values: Any = TOLD) -> None:
    assert (sigmas["t_ns"] - WEEK * WEEK_NS).tolist() == [round(second * 1000) * NS // 1000 for second in seconds]
    for name, value in zip(NAMES, values, strict=True):
        assert sigmas[name] == pytest.approx(np.full(len(seconds), value), rel=1e-6), name


# --- NovAtel ---------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("make", [insstdev, insstdevs, insstdeva])
def test_insstdev(make: Any, tmp_path: Path) -> None:
    path = tmp_path / "a.gps"
    path.write_bytes(b"".join(inspvas(10.0 + k) + make(10.005 + k) for k in range(5)))
    sigmas, dropped = told(tmp_path, "novatel")
    assert not dropped
    is_told(sigmas, [10.005 + k for k in range(5)])
    columns, _ = read("ins", path, "novatel")
    assert (columns["t_ns"] - WEEK * WEEK_NS).tolist() == [(10 + k) * NS for k in range(5)]


def test_inspvax_has_its_own(tmp_path: Path) -> None:
    (tmp_path / "a.gps").write_bytes(b"".join(inspvax(10.0 + k, sigmas=SIGMAS) for k in range(3)))
    is_told(told(tmp_path, "novatel")[0], [10.0, 11.0, 12.0])


def test_inspvax_beside_inspvas_tells_them(tmp_path: Path) -> None:
    """The sigmas are those of usable records alone."""
    records = [inspvas(10.0 + k) + inspvax(10.0 + k, sigmas=SIGMAS, status=ALIGNING if k == 1 else 3) for k in range(4)]
    (tmp_path / "a.gps").write_bytes(b"".join(records))
    sigmas, dropped = told(tmp_path, "novatel")
    is_told(sigmas, [10.0, 12.0, 13.0])
    assert dropped == {"INSPVAX beside INSPVAS": 4}


def test_insstdev_goes_before_inspvax(tmp_path: Path) -> None:
    (tmp_path / "a.gps").write_bytes(b"".join(inspvax(10.0 + k) + insstdev(10.0 + k) for k in range(3)))
    columns, _ = read("ins", tmp_path / "a.gps", "novatel")
    assert len(columns["t_ns"]) == 3
    sigmas, _ = told(tmp_path, "novatel")
    assert sigmas["up_m"][-3:] == pytest.approx([0.023] * 3, rel=1e-6)
    assert len(sigmas["t_ns"]) == 3


@pytest.mark.parametrize("place", [0, 2, 6, 8])
@pytest.mark.parametrize("value", [0.0, -0.1, float("nan"), float("inf"), 50.0])
def test_impossible_values(place: int, value: float, tmp_path: Path) -> None:
    bad = [*SIGMAS]
    bad[place] = value
    (tmp_path / "a.gps").write_bytes(inspvas(9.0) + insstdev(10.0) + insstdev(11.0, bad) + insstdev(12.0))
    sigmas, dropped = told(tmp_path, "novatel")
    is_told(sigmas, [10.0, 12.0])
    assert dropped == {"impossible accuracy": 1}


def test_none_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.gps").write_bytes(inspvas(9.0) + inspvas(9.1))
    assert told(tmp_path, "novatel") == ({}, {})


@pytest.mark.parametrize("latency_s", [0.01, -0.2])
def test_latency_is_taken_off(latency_s: float, tmp_path: Path) -> None:
    (tmp_path / "a.gps").write_bytes(inspvas(9.0) + insstdev(10.0))
    sigmas, _ = told(tmp_path, "novatel", latency_s=latency_s)
    assert sigmas["t_ns"].tolist() == [WEEK * WEEK_NS + 10 * NS - round(latency_s * NS)]


# --- SMRMSG ----------------------------------------------------------------------------------------------------------
@pytest.fixture
def session(tmp_path: Path) -> Path:
    (tmp_path / "a.out").write_bytes(sbet(*(100.0 + k for k in range(50))))
    (tmp_path / "a.smr").write_bytes(smrmsg(*(99.5 + k for k in range(60))))
    return tmp_path


SBET = {"files": ["*.out"], "accuracy": ["*.smr"], "gps_week": WEEK}


def test_smrmsg(session: Path) -> None:
    """Arc-minutes become degrees; down is up."""
    sigmas, dropped = told(session, "sbet", **SBET)
    assert not dropped
    is_told(sigmas, [99.5 + k for k in range(60)], (0.01, 0.02, 0.03, 0.01, 0.015, 0.03))


def test_its_week_is_the_sbets(tmp_path: Path) -> None:
    """The SBET begins just before the week's end, the accuracies just behind it."""
    (tmp_path / "a.out").write_bytes(sbet(604_799.0, 604_799.5, 0.0, 0.5))
    (tmp_path / "a.smr").write_bytes(smrmsg(0.25, 1.25, 2.25))
    sigmas, _ = told(tmp_path, "sbet", **SBET, latency_s=0.25)
    assert (sigmas["t_ns"] - (WEEK + 1) * WEEK_NS).tolist() == [0, NS, 2 * NS]


def test_over_the_weeks_end(tmp_path: Path) -> None:
    (tmp_path / "a.out").write_bytes(sbet(604_799.0, 604_799.5, 0.0, 0.5))
    (tmp_path / "a.smr").write_bytes(smrmsg(*(604_700.0 + k for k in range(100)), 0.0, 1.0))
    sigmas, _ = told(tmp_path, "sbet", **SBET)
    assert np.all(np.diff(sigmas["t_ns"]) == NS)


def test_damaged_accuracies(session: Path) -> None:
    nan = float("nan")
    bad = smrmsg(200.0, rms=(nan, *[0.01] * 8)) + smrmsg(201.0, rms=(0.0, *[0.01] * 8)) + smrmsg(nan)
    (session / "a.smr").write_bytes(smrmsg(*(100.0 + k for k in range(30))) + bad + b"\r\n")
    sigmas, dropped = told(session, "sbet", **SBET)
    assert len(sigmas["t_ns"]) == 30
    assert dropped == {"impossible accuracy": 2, "accuracy at an impossible time": 1, "stray bytes at the end": 2}


def test_raw_files_name_them(session: Path) -> None:
    paths = raw_files(build.settings("ins", ["*.out"], "sbet", accuracy=["*.smr"]), session)
    assert [path.name for path in paths] == ["a.out", "a.smr"]


REFUSED = {
    "cut off": (smrmsg(*(100.0 + k for k in range(9)))[:-30], ["*.smr"], r"a\.smr: is .*not a whole accuracy file"),
    "no file": (b"", ["*.rms"], r"session\.yaml: ins\.accuracy: '\*\.rms' matches no file"),
    "empty": (b"", ["*.smr"], r"a\.smr: is empty, not a whole accuracy file"),
    "an SBET": (sbet(1.0, 2.0), ["*.smr"], r"a\.smr: is SBET, not a whole accuracy file .*ins\.accuracy"),
    "text": (b"Dear diary\n" * 90, ["*.smr"], r"a\.smr: is a text .*not a whole accuracy file"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_refused(what: str, session: Path) -> None:
    content, patterns, words = REFUSED[what]
    (session / "a.smr").write_bytes(content)
    with pytest.raises(RawDataError, match=words) as error:
        told(session, "sbet", files=["*.out"], accuracy=patterns, gps_week=WEEK)
    assert "\n" not in str(error.value)


def test_among_the_files_of_the_ins(session: Path) -> None:
    with pytest.raises(RawDataError, match=r"a\.smr: is an accuracy file .*give the SBET.*under ins\.accuracy"):
        told(session, "sbet", files=["*"], gps_week=WEEK)


@pytest.mark.parametrize("kind", ["novatel", "inertial_explorer", "table"])
def test_beside_an_sbet_alone(kind: str) -> None:
    with pytest.raises(ValueError, match=f"belong to an SBET, but format is {kind}"):
        build.settings("ins", ["a"], kind, accuracy=["b"])


@pytest.mark.parametrize("seed", range(40))
def test_whatever_the_bytes(seed: int, session: Path) -> None:
    rng = np.random.default_rng(seed)
    content = bytearray(smrmsg(*(100.0 + k for k in range(40))))
    for place in rng.integers(0, len(content), 12):
        content[place] = rng.integers(0, 256)
    (session / "a.smr").write_bytes(bytes(content[: rng.integers(1, len(content))]))
    try:
        sigmas, _ = told(session, "sbet", **SBET)
    except PoolcalError as error:
        assert "\n" not in str(error)
        return
    for name in NAMES if sigmas else ():
        assert np.all((sigmas[name] > 0) & (sigmas[name] <= 45)), name
