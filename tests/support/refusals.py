"""What every refusal of bad input must be: one line, status 2, and nothing that a later run would trust."""

from collections.abc import Callable

from tests.support.places import Place, Told, digests

Spoil = Callable[[Place], None]


def one_line(told: Told, *words: str) -> None:
    """Status 2, one line on standard error beside the stages' progress, and it says what it must."""
    assert told.status == 2, told.err
    assert "Traceback" not in told.err
    assert len(told.complaints) == 1, told.err
    line = told.complaints[0]
    assert told.err.endswith(line + "\n")
    assert line.startswith("poolcal: ")
    for word in words:
        assert word in line, line
    assert told.out == ""


def nothing_is_left(place: Place) -> None:
    """No stage has left anything at all: the next run starts from nothing."""
    left = {path.name for path in place.run.iterdir()} if place.run.exists() else set()
    assert left <= {"run.yaml", "digests.json", ".lock"}


def as_if_nothing_had_been(place: Place, right: dict[str, str]) -> None:
    """After mending, the same run folder gives what an undisturbed run gives."""
    left = {path.name for path in place.run.iterdir()}
    assert left <= {"run.yaml", "digests.json", ".lock", "ingest", "georeference"}
    place.mend()
    told = place.calibrate()
    assert told.status == 0, told.err
    assert digests(place.run) == right
