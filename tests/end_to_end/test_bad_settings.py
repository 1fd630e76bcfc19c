"""Wrong values in session.yaml and the pool's config, and settings that do not go with the data."""

from typing import Any

import pytest

from tests.support.effort import often
from tests.support.places import Place
from tests.support.refusals import Spoil, as_if_nothing_had_been, nothing_is_left, one_line


# --- what can be wrong with the two YAML files -----------------------------------------------------------------------
def _config(**values: Any) -> Spoil:
    return lambda place: place.edit_config("target", **values)


def _add(name: str, text: str) -> Spoil:
    def spoil(place: Place) -> None:
        path = place.folder / name
        path.write_text(path.read_text(encoding="utf-8") + text, encoding="utf-8")

    return spoil


def _write(name: str, content: bytes) -> Spoil:
    return lambda place: (place.folder / name).write_bytes(content) and None


def _mount(sensor: str, **values: float) -> Spoil:
    return lambda place: place.edit_session(sensor, mount=values)


def _drop_key(place: Place) -> None:
    path = place.config
    path.write_text("".join(x for x in path.read_text().splitlines(True) if not x.startswith("  c:")), "utf-8")


SESSION = "session/session.yaml"
YAML: dict[str, tuple[Spoil, tuple[str, ...]]] = {
    "negative dimension": (_config(c=-1.0), ("pool.yaml", "target.c = -1.0", "greater than 0", "correct")),
    "dimension of no room": (_config(a=0.9), ("pool.yaml", "target", "a must be >= 2 e", "correct")),
    "text for a number": (_config(a="eight"), ("pool.yaml", "target.a = 'eight'", "correct")),
    "number in quotes": (_config(a="8.0"), ("pool.yaml", "target.a = '8.0'", "correct")),
    "truth value for a number": (_config(a=True), ("pool.yaml", "target.a = True", "correct")),
    "dimension missing": (_drop_key, ("pool.yaml", "target.c", "missing", "add")),
    "unknown key": (_config(d=1.0), ("pool.yaml", "target.d", "unknown key", "known here: a, azimuth_deg, b")),
    "unknown block": (_add("pool.yaml", "segmnt: {margin_m: 0.1}\n"), ("pool.yaml", "segmnt", "unknown key")),
    "key twice": (_add("pool.yaml", "target: {a: 6.0}\n"), ("pool.yaml", "'target'", "given twice")),
    "NaN": (_config(a=float("nan")), ("pool.yaml", "target.a = nan", "finite", "correct")),
    "infinity": (_config(water_level_m=float("inf")), ("pool.yaml", "target.water_level_m = inf", "finite", "correct")),
    "alias": (_add("pool.yaml", "verdict: &x {max_sigma_m: 1.0}\nadjust: *x\n"), ("pool.yaml", "alias")),
    "a list": (_write("pool.yaml", b"- 1\n- 2\n"), ("pool.yaml", "list", "mapping")),
    "nothing": (_write("pool.yaml", b""), ("pool.yaml", "is empty")),
    "binary": (_write("pool.yaml", bytes(range(256)) * 9), ("pool.yaml", "UTF-8")),
    "control characters": (_write("pool.yaml", bytes(99)), ("pool.yaml", "not valid YAML")),
    "no YAML": (_write("pool.yaml", b"target: {a: 1\n"), ("pool.yaml", "not valid YAML")),
    "no blank": (_add("pool.yaml", "verdict:\n  max_sigma_m:1\n  held: []\n"), ("colon of max_sigma_m in line",)),
    "deep YAML": (_write("pool.yaml", b"[" * 9999), ("pool.yaml", "not valid YAML")),
    "huge file": (_write("pool.yaml", b"# much\n" * 200_000), ("pool.yaml", "1400000 bytes", "name the YAML")),
    "object": (_write("pool.yaml", b"!!python/object/apply:os.getcwd []\n"), ("pool.yaml", "not valid YAML")),
    "date": (_add("pool.yaml", "verdict: {max_sigma_m: 2026-05-12}\n"), ("pool.yaml", "verdict.max_sigma_m", "date")),
    "session: unknown key": (_add(SESSION, "gps: 1\n"), ("session.yaml", "gps", "unknown key")),
    "session: key twice": (_add(SESSION, "name: b\n"), ("session.yaml", "'name'", "given twice")),
    "session: NaN": (_mount("mbes", roll_deg=float("nan")), ("session.yaml", "mbes.mount.roll_deg = nan", "correct")),
    "session: absolute path": (
        lambda place: place.edit_session("ins", files=["/etc/*"]),
        ("session.yaml", "ins.files.0 = '/etc/*'", "inside the session folder"),
    ),
    "session: path upwards": (
        lambda place: place.edit_session("ins", files=["../ins/*"]),
        ("session.yaml", "ins.files.0 = '../ins/*'", "inside the session folder"),
    ),
    "session: bad pattern": (lambda place: place.edit_session("ins", files=["ins/**x"]), ("session.yaml",)),
    "session: format of another": (
        lambda place: place.edit_session("ins", format="las"),
        ("session.yaml", "ins.format = 'las'", "novatel"),
    ),
    "session: week out of range": (
        lambda place: place.edit_session("ins", gps_week=42),
        ("session.yaml", "ins.gps_week = 42", "modulo 1024", "42 + 2048 = 2090"),
    ),
    "session: unknown frame": (
        lambda place: place.edit_session("laser", frame="EPSG:0"),
        ("session.yaml", "laser.frame", "EPSG:0", "EPSG:4978"),
    ),
    "session: flat frame": (
        lambda place: place.edit_session("laser", frame="EPSG:32651"),
        ("session.yaml", "laser.frame", "EPSG:32651", "height"),
    ),
}


@pytest.mark.parametrize("what", YAML)
def test_yaml(what: str, place: Place) -> None:
    spoil, words = YAML[what]
    spoil(place)
    one_line(place.calibrate(), *words)
    nothing_is_left(place)


# --- settings that do not go with the data ---------------------------------------------------------------------------
SETTINGS: dict[str, tuple[Spoil, tuple[str, ...]]] = {
    "target 100 m off": (
        _config(origin={"latitude_deg": 36.0009, "longitude_deg": 120.1, "height_m": 12.0}),
        ("target.origin",),
    ),
    "target 100 m up": (
        _config(origin={"latitude_deg": 36.0, "longitude_deg": 120.1, "height_m": 112.0}),
        ("target.origin",),
    ),
    "sonar looks away": (_mount("mbes", roll_deg=48.0), ("mount",)),
    "laser looks away": (_mount("laser", yaw_deg=180.0), ("laser.mount",)),
}


@pytest.mark.parametrize("what", SETTINGS)
def test_settings(what: str, place: Place, right: dict[str, str]) -> None:
    spoil, words = SETTINGS[what]
    spoil(place)
    one_line(place.calibrate(), *words)
    left = {path.name for path in place.run.iterdir()}
    assert left <= {"run.yaml", "digests.json", ".lock", "ingest", "georeference"}
    if what in ("sonar looks away", *often((), ("target 100 m off",))):  # ends after two stages; before any is complete
        as_if_nothing_had_been(place, right)


NEVER_ACCEPTED: dict[str, Spoil] = {
    "target too small": _config(a=6.0, b=2.4, c=0.8, e=0.4),
    "blocks of another height": _config(e=0.4),
    "wall of another width": _config(b=2.6),
    "coarse mount 20 degrees off in roll": _mount("mbes", roll_deg=-28.0),
    "coarse mount 20 degrees off in yaw": _mount("mbes", yaw_deg=17.2),
}


@pytest.mark.parametrize("what", often(list(NEVER_ACCEPTED)[1::2], list(NEVER_ACCEPTED)))
def test_wrong_by_much_is_never_accepted(what: str, place: Place) -> None:
    """Refused with one line, or rejected with reasons: which of the two depends on what is left on the target."""
    NEVER_ACCEPTED[what](place)
    told = place.calibrate()
    assert told.status in (1, 2), told.out
    if told.status == 2:
        one_line(told)
    else:
        assert place.result()["verdict"] == "rejected"
        assert place.result()["reasons"]
