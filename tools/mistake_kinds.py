"""The kinds of mistakes and of real errors that ``tools.mistakes`` plants, each with the names that would be right.

A kind names what was planted by parameters of the adjustment (``maths/adjustment/parameters.py``), by codes of reasons
(``report/reason_codes.py``), or by faces. A kind without names is harmless, or nothing in the program stands for it: no
name would be right.

The effects of real water come at the size that is to be expected, and at three times that size. In their sessions the
INS drifts by the figures that session.yaml has.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tools.campaigns import DRIFT

Block = dict[str, Any]
Change = Callable[[Block, Block, Block], None]  # changes scenario, session and pool in place
TIMES = (1, 3)  # the expected size, and thrice
SHAPE = frozenset({"residuals_by_face", "length_off_design", "angle_off_design", "target_beyond_search"})
DRIFTS = frozenset({"ins_drift_above_settings", "ins_drift_between_passes", "ins_drift_off_figures"})
GEOMETRY = frozenset({"sigma_above_limit", "no_parameter_estimable", "no_result"})
BOWS = ("wet_P1_bow", "wet_P2_bow", "wet_P3_bow")
WET_WALL = frozenset({"P2", "wet_P2_shift", "wet_P2_turn_1", "wet_P2_turn_2", "wet_P2_bow"})
TRUE_PROFILE = [[0.0, 1502.0], [1.5, 1501.5], [2.0, 1499.5], [5.0, 1499.0]]  # a warm layer of 1.5 to 2 m, 0.6 °C


@dataclass(frozen=True)
class Kind:
    """What is wrong in a session, and which names of it would be right."""

    change: Change
    right: frozenset[str] = frozenset()


def _kind(change: Change, *right: str) -> Kind:
    return Kind(change, frozenset(right))


def _scenario(**blocks: Any) -> Change:
    """Return a function that changes the scenario alone.

    The simulator writes session.yaml and pool.yaml from the changed scenario. Of its errors they have the INS's drift,
    and no others.
    """

    def change(scenario: Block, session: Block, pool: Block) -> None:
        for name, values in blocks.items():
            scenario[name] = scenario.get(name, {}) | values

    return change


def _laser(**values: float) -> Change:
    """Return a change that adds errors to the laser's mount in session.yaml."""

    def change(scenario: Block, session: Block, pool: Block) -> None:
        mount = session.get("laser", {}).get("mount", {})
        for name, value in values.items():
            if name in mount:
                mount[name] += value

    return change


def _swapped(scenario: Block, session: Block, pool: Block) -> None:
    """Interchange x and y of the laser's mount in session.yaml."""
    mount = session.get("laser", {}).get("mount", {})
    if mount:
        mount["x_m"], mount["y_m"] = mount["y_m"], mount["x_m"]


def _target(**values: float) -> Change:
    """Return a change that adds errors to the target's dimensions in the pool's config."""

    def change(scenario: Block, session: Block, pool: Block) -> None:
        for name, value in values.items():
            if "target" in pool:
                pool["target"][name] += value

    return change


def _pool(**values: Any) -> Change:
    """Return a change that gives other values to the target in the pool's config."""

    def change(scenario: Block, session: Block, pool: Block) -> None:
        if "target" in pool:
            pool["target"].update(values)

    return change


def _drifting(times: float = 1.0, **figures: float) -> Block:
    """Return an INS whose drift is some times that of session.yaml, or has figures of its own."""
    told: Block = DRIFT["drift"]
    larger = {key: value if "constant" in key else times * value for key, value in told.items()}
    return {"drift": larger | figures, "drift_declared": told}


MISTAKES: dict[str, Kind] = {
    "nothing wrong": _kind(_scenario()),
    "nothing wrong, INS drifts": _kind(_scenario(ins=DRIFT)),
    "drift three times the figures": Kind(_scenario(ins=_drifting(3.0)), DRIFTS),
    "sonar's clock 10 ms off": _kind(_scenario(mbes={"latency_s": 0.01}), "mbes_latency"),
    "sonar's clock 20 ms off": _kind(_scenario(mbes={"latency_s": 0.02}), "mbes_latency"),
    "sonar's clock 60 ms off": _kind(_scenario(mbes={"latency_s": 0.06}), "mbes_latency"),
    "laser's clock 50 ms off": _kind(_scenario(laser={"latency_s": 0.05}), "laser_latency"),
    "sound speed 0.3 % wrong": _kind(_scenario(mbes={"sound_speed_recorded_m_s": 1504.5}), "sound_speed"),
    "sound speed 1 % wrong": _kind(_scenario(mbes={"sound_speed_recorded_m_s": 1515.0}), "sound_speed"),
    "sound speed changes by 0.05 °C/m": _kind(
        _scenario(mbes={"sound_speed_gradient_1_s": 0.15}), "sound_speed_gradient"
    ),
    "target.e 2 cm too large": Kind(_target(e=0.02), SHAPE),
    "target leans by 0.3°": _kind(_scenario(surroundings={"tilt_deg": [0.0, 0.3]})),
    "one row of blocks missing": Kind(_pool(blocks_per_side=9), SHAPE | {"ambiguous_target_pose"}),
    "wrong low_side": Kind(_pool(low_side="north"), SHAPE | {"ambiguous_target_pose"}),
    "15 % outliers": _kind(_scenario(mbes={"outlier_share": 0.15}, laser={"outlier_share": 0.15})),
    "two passes, both at 6 m": Kind(_scenario(track={"distances_m": [6.0, 6.0]}), GEOMETRY),
    "four passes, all at 6 m": Kind(_scenario(track={"distances_m": [6.0, 6.0, 6.0, 6.0]}), GEOMETRY),
    "INS drifts, one pass alone": Kind(_scenario(ins=DRIFT, track={"distances_m": [5.0]}), GEOMETRY),
    "laser.mount: roll 0.1° wrong": _kind(_laser(roll_deg=0.1), "laser_rotation_y"),
    "laser.mount: pitch 0.44° wrong (sign)": _kind(_laser(pitch_deg=0.44), "laser_rotation_x"),
    "laser.mount: yaw 0.2° wrong": _kind(_laser(yaw_deg=0.2), "laser_rotation_z"),
    "laser.mount: x and y interchanged": _kind(_swapped, "laser_lever_arm_x", "laser_lever_arm_y"),
    "laser.mount: z 0.1 m wrong": _kind(_laser(z_m=0.1), "laser_lever_arm_z"),
    "target.b 5 cm too large": _kind(_target(b=0.05), "length_off_design"),
    "target.c 20 cm too large": Kind(_target(c=0.2), SHAPE),
}


@dataclass(frozen=True)
class Effect:
    """An error of real water: its words with a place for the size, the expected size, the scenario by size."""

    words: str
    size: float
    blocks: Callable[[float], Block]
    right: frozenset[str] = frozenset()

    def kinds(self) -> dict[str, Kind]:
        """Return the kinds at all sizes, by their words."""
        sizes = [round(times * self.size, 6) for times in TIMES]
        changes = [_scenario(**{"ins": DRIFT} | self.blocks(size)) for size in sizes]
        return {self.words.format(size): Kind(one, self.right) for size, one in zip(sizes, changes, strict=True)}


def _effect(words: str, size: float, blocks: Callable[[float], Block], *right: str) -> Effect:
    return Effect(words, size, blocks, frozenset(right))


def _mbes(name: str, unit: float = 1.0, **others: Any) -> Callable[[float], Block]:
    """Return the scenario by the size of one of the sonar's settings, in units."""
    return lambda size: {"mbes": {name: size * unit} | others}


def _of_laser(name: str, unit: float = 1.0, **others: Any) -> Callable[[float], Block]:
    return lambda size: {"laser": {name: size * unit} | others}


def _faces(*faces: str, **unit: Any) -> Callable[[float], Block]:
    """Return the scenario by the size of the fault of wet faces."""

    def blocks(size: float) -> Block:
        values = {name: (size * np.array(of_one)).tolist() for name, of_one in unit.items()}
        return {"surroundings": {"face_faults": [{"faces": list(faces), "part": "wet"} | values]}}

    return blocks


def _projector(axis: int) -> Callable[[float], Block]:
    return lambda size: {"mbes": {"projector_offset_m": [size / 1000 if k == axis else 0.0 for k in range(3)]}}


def _layers(by_m: float) -> list[list[float]]:
    """Return the true profile with its layers deeper by some metres, the surface's speed at zero."""
    return [[0.0, TRUE_PROFILE[0][1]], *([depth + by_m, speed] for depth, speed in TRUE_PROFILE[1:])]


def _stratified(size: float) -> Block:
    """Return water whose speeds differ from 1500 m/s ``size`` times as much as TRUE_PROFILE's, without a cast."""
    return {"mbes": {"sound_speed_profile": [[depth, 1500 + size * (speed - 1500)] for depth, speed in TRUE_PROFILE]}}


EFFECTS = (
    _effect(
        "sonar: ranges {:g} mm short at 45°, as 1/cos i - 1", 10, _mbes("incidence_bias_m", -1e-3), "mbes_incidence"
    ),
    _effect(
        "sonar: ranges {:g} mm short at 45°, as tan² i", 10,
        # the parameter goes as 1/cos i - 1; what tan² i has beyond it is on the grazed, that is the level faces
        _mbes("incidence_bias_m", -1e-3, incidence_law="tangent_squared"), "mbes_incidence", "mbes_level_range",
    ),
    _effect("sonar: all ranges {:g} mm long", 10, _mbes("range_bias_m", 1e-3), "mbes_range"),
    _effect(
        "sonar: ranges of level faces {:g} mm long", 10, _mbes("level_bias_m", 1e-3), "mbes_level_range", "wet_H_shift"
    ),
    _effect("sonar: noise × {:g} at 45° along track", 3, _mbes("slanted_noise")),
    _effect("sonar: noise × {:g} at 45°", 2, _mbes("incidence_noise")),
    _effect("sonar: near field, aperture {:g} m", 0.19, lambda size: {"mbes": {"aperture_m": [size, size / 2]}}),
    _effect("sonar: {:g} of beams near corners by a side lobe", 0.1, _mbes("side_lobe_share")),
    _effect(
        "sonar: ranges near corners drawn {:g} of the way to the corner's", 0.3,
        _mbes("side_lobe_pull", side_lobe_share=1.0),
    ),
    _effect("sonar: {:g} of beams near the water line by an image", 0.3, _mbes("image_share")),
    _effect("transmitter {:g} mm to starboard", 20, _projector(0), "projector_x"),
    _effect("transmitter {:g} mm forward", 119, _projector(1), "projector_y"),
    _effect("transmitter {:g} mm up", 40, _projector(2), "projector_z"),
    _effect("sonar: roll of a ping {:g}°", 0.02, _mbes("ping_roll_sigma_deg")),
    _effect("sonar: ranges of a ping {:g} mm", 3, _mbes("ping_range_sigma_m", 1e-3)),
    _effect("sonar: steering {:g}° alike in neighbours", 0.06, _mbes("steering_sigma_deg")),
    _effect("sonar: sound {:g} % faster at the arrays alone", 0.1, _mbes("head_speed_excess", 0.01), "steering_speed"),
    _effect("layers of water, × {:g}, no cast", 1, _stratified, "sound_speed_gradient"),
    _effect(
        "layers of water {:g} m deeper than the cast says", 0.3,
        lambda size: {"mbes": {"sound_speed_profile": _layers(size), "svp_declared": TRUE_PROFILE}},
        "sound_speed_gradient", "sound_speed",
    ),
    _effect(
        "sonar stamps reception, at {:g} m/s", 0.4,
        lambda size: {"mbes": {"stamp": "reception", "format": "parquet"}, "track": {"speed_m_s": size}},
        "mbes_latency",
    ),
    _effect("sonar: pings' times {:g} ms", 0.5, _mbes("pps_jitter_s", 1e-3)),
    _effect("INS: drift within 10 s, × {:g}", 1, lambda size: {"ins": _drifting(
        horizontal_m=0.01 * size, vertical_m=0.01 * size, roll_pitch_deg=0.005 * size, heading_deg=0.01 * size,
        time_constant_s=10.0)}, *DRIFTS),
    _effect("INS: drift within 30 s on top, {:g} mm", 10, lambda size: {"ins": DRIFT | {"second_drift": {
        "horizontal_m": size / 1000, "vertical_m": size / 1000, "roll_pitch_deg": 0.0, "heading_deg": 0.0,
        "time_constant_s": 30.0}}}, *DRIFTS),
    _effect("INS: steps of {:g} mm at full seconds", 3, lambda size: {"ins": DRIFT | {"gnss_step_m": size / 1000}}),
    _effect("wet wall bowed by {:g} mm", 3, _faces("P2", bow_m=-1e-3), *WET_WALL),
    _effect(
        "all wet vertical faces bowed by {:g} mm", 3, _faces("P1", "P2", "P3", bow_m=-1e-3), "residuals_by_face", *BOWS
    ),
    _effect("P3-1 under water {:g} mm off", 20, _faces("P3-1", shift_m=1e-3), "P3-1"),
    _effect("P3-1-top {:g} mm too high", 20, _faces("P3-1-top", shift_m=1e-3), "P3-1-top"),
    _effect("P1-2 under water turned by {:g}°", 0.3, _faces("P1-2", turn_deg=[1.0, 0.0]), "P1-2"),
    _effect("wet wall leans by {:g}°", 0.05, _faces("P2", turn_deg=[0.0, 1.0]), *WET_WALL),
    _effect(  # or P2 away from it: the lever arm takes the rest
        "wet P1 and P3 {:g} mm to the boat", 7, _faces("P1", "P3", shift_m=1e-3),
        "wet_P1_shift", "wet_P2_shift", "wet_P3_shift",
    ),
    _effect("faces uneven by {:g} mm", 2, lambda size: {"surroundings": {"unevenness_m": size / 1000}}),
    _effect("laser: ranges {:g} mm long at 45°, as tan² i", 1, _of_laser("incidence_bias_m", 1e-3), "laser_incidence"),
    _effect("laser: ranges of level faces {:g} mm short", 5, _of_laser("level_bias_m", -1e-3), "wet_H_shift"),
    _effect("laser: spot {:g} mm, 0.03°", 7, _of_laser("spot_m", 1e-3, spot_divergence_deg=0.03)),
    _effect("laser: {:g} of the rays near the water end in drops", 0.2, _of_laser("splash_share")),
)  # fmt: skip
for _one in EFFECTS:
    MISTAKES |= _one.kinds()
