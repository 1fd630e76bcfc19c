"""The crew's mistakes that ``tools.mistakes`` plants, each with the names that would be right.

A kind names what was planted by parameters of the adjustment (``maths/adjustment/parameters.py``), by codes of reasons
(``report/reason_codes.py``), or by faces. A kind without names is harmless, or nothing in the program stands for it: no
name would be right.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tools.campaigns import DRIFT

Block = dict[str, Any]
Change = Callable[[Block, Block, Block], None]  # changes scenario, session and pool in place
SHAPE = frozenset({"residuals_by_face", "length_off_design", "angle_off_design", "target_beyond_search"})
DRIFTS = frozenset({"ins_drift_above_settings", "ins_drift_between_passes", "ins_drift_off_figures"})
GEOMETRY = frozenset({"sigma_above_limit", "no_parameter_estimable", "no_result"})


@dataclass(frozen=True)
class Kind:
    """What is wrong in a session, and which names of it would be right."""

    change: Change
    right: frozenset[str] = frozenset()


def _kind(change: Change, *right: str) -> Kind:
    return Kind(change, frozenset(right))


def scenario_change(**blocks: Any) -> Change:
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


def drifting(times: float = 1.0, **figures: float) -> Block:
    """Return an INS whose drift is some times that of session.yaml, or has figures of its own."""
    told: Block = DRIFT["drift"]
    larger = {key: value if "constant" in key else times * value for key, value in told.items()}
    return {"drift": larger | figures, "drift_declared": told}


OF_THE_CREW: dict[str, Kind] = {
    "nothing wrong": _kind(scenario_change()),
    "nothing wrong, INS drifts": _kind(scenario_change(ins=DRIFT)),
    "drift three times the figures": Kind(scenario_change(ins=drifting(3.0)), DRIFTS),
    "sonar's clock 10 ms off": _kind(scenario_change(mbes={"latency_s": 0.01}), "mbes_latency"),
    "sonar's clock 20 ms off": _kind(scenario_change(mbes={"latency_s": 0.02}), "mbes_latency"),
    "sonar's clock 60 ms off": _kind(scenario_change(mbes={"latency_s": 0.06}), "mbes_latency"),
    "laser's clock 50 ms off": _kind(scenario_change(laser={"latency_s": 0.05}), "laser_latency"),
    "sound speed 0.3 % wrong": _kind(scenario_change(mbes={"sound_speed_recorded_m_s": 1504.5}), "sound_speed"),
    "sound speed 1 % wrong": _kind(scenario_change(mbes={"sound_speed_recorded_m_s": 1515.0}), "sound_speed"),
    "sound speed changes by 0.05 °C/m": _kind(
        scenario_change(mbes={"sound_speed_gradient_1_s": 0.15}), "sound_speed_gradient"
    ),
    "target.e 2 cm too large": Kind(_target(e=0.02), SHAPE),
    "target leans by 0.3°": _kind(scenario_change(surroundings={"tilt_deg": [0.0, 0.3]})),
    "one row of blocks missing": Kind(_pool(blocks_per_side=9), SHAPE | {"ambiguous_target_pose"}),
    "wrong low_side": Kind(_pool(low_side="north"), SHAPE | {"ambiguous_target_pose"}),
    "15 % outliers": _kind(scenario_change(mbes={"outlier_share": 0.15}, laser={"outlier_share": 0.15})),
    "two passes, both at 6 m": Kind(scenario_change(track={"distances_m": [6.0, 6.0]}), GEOMETRY),
    "four passes, all at 6 m": Kind(scenario_change(track={"distances_m": [6.0, 6.0, 6.0, 6.0]}), GEOMETRY),
    "INS drifts, one pass alone": Kind(scenario_change(ins=DRIFT, track={"distances_m": [5.0]}), GEOMETRY),
    "laser.mount: roll 0.1° wrong": _kind(_laser(roll_deg=0.1), "laser_rotation_y"),
    "laser.mount: pitch 0.44° wrong (sign)": _kind(_laser(pitch_deg=0.44), "laser_rotation_x"),
    "laser.mount: yaw 0.2° wrong": _kind(_laser(yaw_deg=0.2), "laser_rotation_z"),
    "laser.mount: x and y interchanged": _kind(_swapped, "laser_lever_arm_x", "laser_lever_arm_y"),
    "laser.mount: z 0.1 m wrong": _kind(_laser(z_m=0.1), "laser_lever_arm_z"),
    "target.b 5 cm too large": _kind(_target(b=0.05), "length_off_design"),
    "target.c 20 cm too large": Kind(_target(c=0.2), SHAPE),
}
