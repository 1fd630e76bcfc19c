"""The errors of real water that ``tools.mistakes`` plants, at the size that is to be expected and at three times it.

In these sessions the INS drifts by the figures that session.yaml has, but for the kinds that concern it. All kinds,
with the crew's mistakes, are ``MISTAKES``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tools.campaigns import DRIFT
from tools.mistake_kinds import DRIFTS, OF_THE_CREW, Block, Change, Kind, drifting, scenario_change

REFUSED = "refused"  # in place of a name: one line says what is wrong, and nothing is calibrated
TIMES = (1, 3)  # the expected size, and thrice
BOWS = ("wet_P1_bow", "wet_P2_bow", "wet_P3_bow", "wet_bows")
WET_WALL = frozenset({"P2", "wet_P2_shift", "wet_P2_turn_1", "wet_P2_turn_2", "wet_P2_bow"})
SIDES = ("wet_P1_shift", "wet_P2_shift", "wet_P3_shift", "wet_shifts")
WET_SIDES = (  # or P2 the other way: roll takes the rest
    "wet_P1_turn_1", "wet_P1_turn_2", "wet_P3_turn_1", "wet_P3_turn_2", "wet_P2_turn_2", "wet_turns",
)  # fmt: skip
TRUE_PROFILE = [[0.0, 1502.0], [1.5, 1501.5], [2.0, 1499.5], [5.0, 1499.0]]  # a warm layer of 1.5 to 2 m, 0.6 °C


@dataclass(frozen=True)
class Effect:
    """An error of real water: its words with a place for the size, the expected size, the scenario by size.

    session: what session.yaml has otherwise than the simulator writes it.
    """

    words: str
    size: float
    blocks: Callable[[float], Block]
    right: frozenset[str] = frozenset()
    session: Change | None = None

    def kinds(self) -> dict[str, Kind]:
        """Return the kinds at all sizes, by their words."""
        sizes = [round(times * self.size, 6) for times in TIMES]
        changes = [_both(scenario_change(**{"ins": DRIFT} | self.blocks(size)), self.session) for size in sizes]
        return {self.words.format(size): Kind(one, self.right) for size, one in zip(sizes, changes, strict=True)}


def _both(first: Change, second: Change | None) -> Change:
    if second is None:
        return first

    def change(scenario: Block, session: Block, pool: Block) -> None:
        first(scenario, session, pool)
        second(scenario, session, pool)

    return change


def _effect(
    words: str, size: float, blocks: Callable[[float], Block], *right: str, session: Change | None = None
) -> Effect:
    return Effect(words, size, blocks, frozenset(right), session)


def _mbes(name: str, unit: float = 1.0, **others: Any) -> Callable[[float], Block]:
    """Return the scenario by the size of one of the sonar's settings, in units."""
    return lambda size: {"mbes": {name: size * unit} | others}


def _of_laser(name: str, unit: float = 1.0, **others: Any) -> Callable[[float], Block]:
    return lambda size: {"laser": {name: size * unit} | others}


def _faces(*faces: str, part: str = "wet", **unit: Any) -> Callable[[float], Block]:
    """Return the scenario by the size of the fault of a part of the faces."""

    def blocks(size: float) -> Block:
        values = {name: (size * np.array(of_one)).tolist() for name, of_one in unit.items()}
        return {"surroundings": {"face_faults": [{"faces": list(faces), "part": part} | values]}}

    return blocks


def _projector(axis: int, sign: int = 1) -> Callable[[float], Block]:
    return lambda size: {"mbes": {"projector_offset_m": [sign * size / 1000 if k == axis else 0.0 for k in range(3)]}}


def _near_field(size: float) -> Block:
    return {"mbes": {"aperture_m": [size, size / 2]}}


def _focused(scenario: Block, session: Block, pool: Block) -> None:
    """Say in session.yaml that the head focuses both ways."""
    if "mbes" in session:
        session["mbes"]["focused"] = [True, True]


def _of_arrays(size: float) -> Block:
    """Return a sound speed that is right at the arrays, where it is recorded, and too high by % for the water."""
    return {"mbes": {"sound_speed_recorded_m_s": 1500 * (1 + size / 100), "head_speed_excess": size / 100}}


def _leaning(size: float) -> Block:
    """Return wet blocks whose faces lean by degrees as one, from the water line downward away from the boat."""
    faults = []
    for family, lowest_m in (("P1", -3.75), ("P3", -3.25)):  # height of the middle of the lowest block
        for number in range(4):
            shift_m = float(np.tan(np.radians(size)) * (lowest_m + number))
            faults.append({"faces": [f"{family}-{number}"], "part": "wet", "shift_m": shift_m, "turn_deg": [0.0, size]})
    return {"surroundings": {"face_faults": faults}}


def _each_block(size: float) -> Block:
    """Return wet blocks that are off by errors with this sigma, mm, of their own, the same in all sessions."""
    names = [f"{family}-{number}" for family in ("P1", "P3") for number in range(4)]
    shifts = np.random.default_rng(11).normal(size=len(names)) * size / 1000
    pairs = zip(names, shifts.tolist(), strict=True)
    return {"surroundings": {"face_faults": [{"faces": [name], "part": "wet", "shift_m": by} for name, by in pairs]}}


def _layers(by_m: float) -> list[list[float]]:
    """Return the true profile with its layers deeper by some metres, the surface's speed at zero."""
    return [[0.0, TRUE_PROFILE[0][1]], *([depth + by_m, speed] for depth, speed in TRUE_PROFILE[1:])]


def _stratified(size: float) -> Block:
    """Return water whose speeds differ from 1500 m/s ``size`` times as much as TRUE_PROFILE's, without a cast."""
    return {"mbes": {"sound_speed_profile": [[depth, 1500 + size * (speed - 1500)] for depth, speed in TRUE_PROFILE]}}


EFFECTS = (
    _effect(
        "sonar: ranges {:g} mm short at 45°, as 1/cos i - 1", 10, _mbes("incidence_bias_m", -1e-3), "mbes_incidence",
        "mbes_detection",
    ),
    _effect(
        "sonar: ranges {:g} mm short at 45°, as tan² i", 10,
        # the parameter goes as 1/cos i - 1; what tan² i has beyond it is on the grazed, that is the level faces
        _mbes("incidence_bias_m", -1e-3, incidence_law="tangent_squared"), "mbes_incidence", "mbes_level_range",
        "mbes_detection",
    ),
    _effect("sonar: all ranges {:g} mm long", 10, _mbes("range_bias_m", 1e-3), "mbes_range"),
    _effect(
        "sonar: ranges of level faces {:g} mm long", 10, _mbes("level_bias_m", 1e-3), "mbes_level_range", "wet_H_shift"
    ),
    _effect(
        "sonar: ranges of level faces {:g} mm short", 10, _mbes("level_bias_m", -1e-3), "mbes_level_range",
        "wet_H_shift",
    ),
    _effect("sonar: noise × {:g} at 45° along track", 3, _mbes("slanted_noise"), "noise"),
    _effect("sonar: noise × {:g} at 45°", 2, _mbes("incidence_noise"), "noise"),
    _effect("sonar: near field, aperture {:g} m", 0.19, _near_field, "noise"),
    _effect(
        "sonar: near field, aperture {:g} m, not declared", 0.19, _near_field, "residuals_by_height", session=_focused
    ),
    _effect("sonar: {:g} of beams near corners by a side lobe", 0.1, _mbes("side_lobe_share")),
    _effect(
        "sonar: ranges near corners drawn {:g} of the way to the corner's", 0.3,
        _mbes("side_lobe_pull", side_lobe_share=1.0),
    ),
    _effect("sonar: {:g} of beams near the water line by an image", 0.3, _mbes("image_share"), "residuals_by_height"),
    _effect("transmitter {:g} mm to starboard", 20, _projector(0), "projector_x"),
    _effect("transmitter {:g} mm forward", 119, _projector(1), "projector_y"),
    _effect("transmitter {:g} mm up", 119, _projector(2), "projector_z"),
    _effect("transmitter {:g} mm down", 119, _projector(2, -1), "projector_z"),
    _effect("sonar: angles {:g}° · sin 2θ off", 0.02, _mbes("array_ripple_deg")),
    _effect("sonar: roll of a ping {:g}°", 0.02, _mbes("ping_roll_sigma_deg")),
    _effect("sonar: ranges of a ping {:g} mm", 3, _mbes("ping_range_sigma_m", 1e-3)),
    _effect("sonar: steering {:g}° alike in neighbours", 0.06, _mbes("steering_sigma_deg"), "noise"),
    _effect("sonar: sound {:g} % faster at the arrays alone", 0.1, _mbes("head_speed_excess", 0.01), "steering_speed"),
    _effect(
        "sonar: sound {:g} % slower in the water than at the arrays", 0.1, _of_arrays, "sound_speed", "steering_speed"
    ),
    _effect("layers of water, × {:g}, no cast", 1, _stratified, "sound_speed_gradient", "sound_speed"),
    _effect(
        "layers of water {:g} m deeper than the cast says", 0.3,
        lambda size: {"mbes": {"sound_speed_profile": _layers(size), "svp_declared": TRUE_PROFILE}},
        "sound_speed_gradient", "sound_speed",
    ),
    _effect(
        "sonar stamps reception, at {:g} m/s", 0.4,
        lambda size: {"mbes": {"stamp": "reception", "format": "parquet"}, "track": {"speed_m_s": size}},
        REFUSED,
    ),
    _effect("sonar: pings' times {:g} ms", 0.5, _mbes("pps_jitter_s", 1e-3)),
    _effect("INS: drift within 10 s, × {:g}", 1, lambda size: {"ins": drifting(
        horizontal_m=0.01 * size, vertical_m=0.01 * size, roll_pitch_deg=0.005 * size, heading_deg=0.01 * size,
        time_constant_s=10.0)}, *DRIFTS),
    _effect("INS: drift within 30 s on top, {:g} mm", 10, lambda size: {"ins": DRIFT | {"second_drift": {
        "horizontal_m": size / 1000, "vertical_m": size / 1000, "roll_pitch_deg": 0.0, "heading_deg": 0.0,
        "time_constant_s": 30.0}}}, *DRIFTS),
    _effect(
        "INS: steps of {:g} mm at full seconds", 5, lambda size: {"ins": DRIFT | {"gnss_step_m": size / 1000}}, *DRIFTS
    ),
    _effect("wet wall bowed by {:g} mm", 3, _faces("P2", bow_m=-1e-3), *WET_WALL),
    _effect(
        "all wet vertical faces bowed by {:g} mm", 3, _faces("P1", "P2", "P3", bow_m=-1e-3), *BOWS
    ),
    _effect("P3-1 under water {:g} mm off", 20, _faces("P3-1", shift_m=1e-3), "P3-1"),
    _effect("P3-1-top {:g} mm too high", 20, _faces("P3-1-top", shift_m=1e-3), "P3-1-top"),
    _effect("P1-2 under water turned by {:g}°", 0.3, _faces("P1-2", turn_deg=[1.0, 0.0]), "P1-2", "wet_P1_turn_1"),
    _effect("wet wall leans by {:g}°", 0.05, _faces("P2", turn_deg=[0.0, 1.0]), *WET_WALL),
    _effect("wet P1 and P3 lean by {:g}°", 0.05, _leaning, *WET_SIDES),
    _effect("each wet block off at random, {:g} mm", 3, _each_block, "residuals_by_face"),
    _effect(  # or P2 away from it: the lever arm takes the rest
        "wet P1 and P3 {:g} mm to the boat", 7, _faces("P1", "P3", shift_m=1e-3),
        *SIDES,
    ),
    _effect(
        "faces uneven by {:g} mm", 2, lambda size: {"surroundings": {"unevenness_m": size / 1000}}, "residuals_by_face"
    ),
    _effect("laser: ranges {:g} mm long at 45°, as tan² i", 1, _of_laser("incidence_bias_m", 1e-3), "laser_incidence"),
    _effect("dry P1 and P3 {:g} mm to the boat", 3, _faces("P1", "P3", part="dry", shift_m=1e-3), *SIDES),
    _effect("laser: ranges of level faces {:g} mm short", 5, _of_laser("level_bias_m", -1e-3), "wet_H_shift"),
    _effect("laser: spot {:g} mm, 0.03°", 7, _of_laser("spot_m", 1e-3, spot_divergence_deg=0.03)),
    _effect(
        "laser: {:g} of the rays near the water end in drops", 0.2, _of_laser("splash_share"), "residuals_by_height"
    ),
)  # fmt: skip
MISTAKES = OF_THE_CREW | {words: kind for effect in EFFECTS for words, kind in effect.kinds().items()}
