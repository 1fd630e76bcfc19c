"""The same input gives the same bytes, and only what changed is run again, with the reason said."""

import os
import shutil
import subprocess
import sys

import pytest

from stages import ORDER
from tests.support.effort import often
from tests.support.places import Place, Told, digests, poolcal, poolcal_process
from tests.support.refusals import one_line
from tests.support.roots import ROOT


# --- the same bytes --------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("jobs", "threads"), often([(2, "2")], [(1, "1"), (2, "2")]))
def test_jobs_processes_and_threads(place: Place, right: dict[str, str], jobs: int, threads: str) -> None:
    """Another process, another folder, other numbers of workers and of BLAS threads: every table byte for byte."""
    limits = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), threads)
    told = poolcal_process(*place.words(), "--jobs", jobs, **limits)
    assert told.status == 0, told.err
    assert digests(place.run) == right
    assert {name.split("/")[0] for name in right} == set(ORDER)


def test_the_digests_tell_two_results_apart(place: Place, right: dict[str, str]) -> None:
    place.raw("mbes").write_bytes(place.raw("mbes").read_bytes()[:-20_000])
    assert place.calibrate().status == 0
    different = {name for name, digest in digests(place.run).items() if right.get(name) != digest}
    assert {name.split("/")[0] for name in different} == set(ORDER)


# --- what is run again -----------------------------------------------------------------------------------------------
def after(stage: str) -> list[str]:
    return list(ORDER[ORDER.index(stage) :])


def one_stage(place: Place, stage: str) -> Told:
    return poolcal("stage", stage, place.run, "--session", place.session, "--config", place.config, "--jobs", 1)


def test_twice_does_nothing(done: Place, right: dict[str, str]) -> None:
    told = done.calibrate()
    assert told.err == "".join(f"{name}: up to date\n" for name in ORDER)
    assert told.status == 0
    assert digests(done.run) == right


def test_the_second_time_nothing_is_imported_that_computes_or_draws(done: Place) -> None:
    words = [*map(str, done.words()), "--no-report", "--no-recordings"]
    code = (
        f"import sys; from stages.cli import call; status = call({words});"
        "heavy = {'scipy', 'numba', 'open3d', 'matplotlib', 'rerun', 'jinja2', 'laspy'} & set(sys.modules);"
        "sys.exit(f'imported {heavy}' if heavy else status)"
    )
    told = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stderr
    assert told.stderr.count(": up to date") == len(ORDER)


@pytest.mark.parametrize(
    ("block", "key", "value", "stage", "reason"),
    [
        ("segment", "margin_m", 0.04, "segment", "segment: segment.margin_m 0.015 -> 0.04"),
        ("verdict", "max_sigma_deg", 0.06, "report", "report: verdict.max_sigma_deg null -> 0.06"),
        pytest.param(
            "adjust", "robust_k0", 2.5, "segment", "segment: adjust.robust_k0 3.0 -> 2.5", marks=pytest.mark.thorough
        ),
        ("adjust", "moment_s", 0.2, "adjust", "adjust: adjust.moment_s 0.1 -> 0.2"),
        ("", "result", "patent_alternating", "report", "report: result adjustment -> patent_alternating"),
    ],
)
def test_a_changed_setting(
    done: Place, right: dict[str, str], block: str, key: str, value: object, stage: str, reason: str
) -> None:
    accepted = done.run / "report" / "calibration.json"
    first = accepted.read_bytes()
    done.edit_config(block, **{key: value})
    told = done.calibrate()
    assert told.status == 0, told.err
    assert told.ran == after(stage)
    kept = [path.read_bytes() for path in done.run.glob("report.*/calibration.json")]
    assert kept == [first]
    assert f"{reason}\n" in told.err
    for name in ORDER[: ORDER.index(stage)]:
        assert f"{name}: up to date\n" in told.err
    before = {name: digest for name, digest in right.items() if name.split("/")[0] not in told.ran}
    assert before.items() <= digests(done.run).items()


def test_a_change_that_makes_no_difference_goes_no_further(done: Place, right: dict[str, str]) -> None:
    """A wider box holds more points, none of them on the target: once the labels are the same, nothing else is run."""
    done.edit_config("georeference", box_margin_m=1.6)
    told = done.calibrate()
    assert "georeference: georeference.box_margin_m 1.5 -> 1.6\n" in told.err
    assert told.ran[:2] == ["georeference", "segment"]
    assert "ingest: up to date\n" in told.err
    for name in set(ORDER) - set(told.ran):
        assert f"{name}: up to date\n" in told.err


def test_a_changed_coarse_mount(done: Place, right: dict[str, str]) -> None:
    """The canonical tables stay, whatever else is made again: they do not depend on the mount."""
    done.edit_session("mbes", mount={"x_m": 0.37})
    told = one_stage(done, "georeference")
    assert "georeference: mbes.mount.x_m 0.38 -> 0.37\n" in told.err
    assert told.ran == ["georeference"]
    ingested = {name: digest for name, digest in right.items() if name.startswith("ingest/")}
    assert ingested.items() <= digests(done.run).items()


def test_another_sessions_raw_files_under_the_same_name(done: Place, right: dict[str, str]) -> None:
    """session.yaml is soon copied. Cut by a few bytes each, no file has the content of one that was calibrated."""
    done.session.rename(done.session.with_name("next_day"))
    other = done.session.with_name("next_day")
    for path in (other / "mbes").iterdir():
        path.write_bytes(path.read_bytes()[:-1])
    words = ("run", other, "--config", done.config, "--run", done.run, "--jobs", 1)
    told = poolcal(*words)
    one_line(told, str(done.run), "another session", str(done.template), "--overwrite")
    assert digests(done.run) == right
    assert poolcal(*words, "--overwrite").ran[0] == "ingest"
    assert len(list(done.run.glob("report.1/calibration.*"))) == 2
    assert poolcal("verify", done.run).status == 0


def test_touching_is_no_change(done: Place) -> None:
    for path in done.session.rglob("*"):
        os.utime(path)
    os.utime(done.config)
    assert done.calibrate().ran == []


def test_comments_and_order_are_no_change(done: Place) -> None:
    done.config.write_text("# as surveyed in May\n" + done.config.read_text(encoding="utf-8"), encoding="utf-8")
    assert done.calibrate().ran == []


def test_one_byte_is_a_change(done: Place) -> None:
    """A bit of one point's coordinates; size and time of the file stay."""
    path = done.raw("laser")
    status, content = path.stat(), bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    told = one_stage(done, "ingest")
    assert told.ran == ["ingest"]
    assert "ingest: laser/pass_0.las changed\n" in told.err


def test_a_lost_or_edited_result_is_made_again(done: Place, right: dict[str, str]) -> None:
    (done.run / "adjust" / "estimate.parquet").write_bytes(b"PAR1")
    (done.run / "fit_planes" / "manifest.json").unlink()
    told = done.calibrate()
    assert "fit_planes: has no result yet\n" in told.err
    assert "adjust: its result estimate.parquet was edited\n" in told.err
    assert not {"ingest", "georeference", "segment"} & set(told.ran)
    assert digests(done.run) == right


# --- make ------------------------------------------------------------------------------------------------------------
def make(place: Place, target: str) -> str:
    command = ["make", "--no-print-directory", "-o", ".venv/.setup", target]
    words = [f"SESSION={place.session}", f"CONFIG={place.config}", f"RUN={place.run}", "JOBS=1"]
    done = subprocess.run([*command, *words], cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


@pytest.mark.thorough
def test_make_calibrate_twice(done: Place, right: dict[str, str]) -> None:
    for name in ORDER[-2:]:
        shutil.rmtree(done.run / name)
    first = make(done, "calibrate")
    assert "ACCEPTED" in first
    assert all(f"{name}: up to date" in first for name in ORDER[:-2])
    assert all(f"{name}: done in" in first for name in ORDER[-2:])
    second = make(done, "calibrate")
    assert "ACCEPTED" in second
    assert all(f"{name}: up to date" in second for name in ORDER)
    assert "done in" not in second
    assert digests(done.run) == right


@pytest.mark.thorough
def test_make_stages_twice(place: Place, right: dict[str, str]) -> None:
    first = make(place, "stages")
    assert all(f"poolcal stage {name} " in first for name in ORDER)
    assert digests(place.run) == right
    assert "poolcal" not in make(place, "stages")


@pytest.mark.thorough
def test_make_stages_after_a_change_of_the_program(place: Place, right: dict[str, str]) -> None:
    """Make offers every stage to the program, which finds by content that none is out of date."""
    make(place, "stages")
    for name in ORDER:
        os.utime(place.run / name / "manifest.json", (0, 0))
    again = make(place, "stages")
    assert all(f"poolcal stage {name} " in again and f"{name}: up to date" in again for name in ORDER)
    assert "poolcal" not in make(place, "stages")
