"""The patent's angles, word for word: full angles between normals, signs from two cosines, corrections I + Ω.

Numbers in brackets are paragraphs of patent CN 105425246 B. This form shows what the printed steps give, and is never a
result. ``patent_sequential`` (:mod:`pipeline.maths.patent.angles`) takes the same steps without their faults.

As printed. One plane for each sensor and each of P1, P2, P3, by plain total least squares over all its points
[0051-0088]; P4 perpendicular to P1 and P2 [0104]. The deviation of each step is the *full* angle between the two
sensors' normals, of P2 for roll, P3 for yaw, P4 for pitch. Its sign follows from two cosines, one for each sensor
[0113-0117]. The corrections are added to those of the steps before [0123], and the soundings are placed anew with
(I + Ω) R_body_from_mbes [0119-0121]: the deviations, found in the target's axes, are taken as angles about the body's
axes. It ends when the angles between the normals are below a threshold [0123].

Readings, where the text leaves a choice:

* Signs: [0113-0117]. They and [0025-0029] contradict each other for roll. To first order in a turn (α about x, β about
  y, γ about z) of the MBES's points, with the normals of CONVENTIONS.md and n4 = n1 x n2, the cosine of the MBES
  exceeds that of the laser by β (n2 with (0, 0, 1)), by γ/√2 (n3 with the laser's n2), and by (β - α)/√2 (n4 with the
  laser's n1). So [0113-0117] give the signs of +β, +γ and, without roll, +α: the deviation of the MBES from the laser,
  as they call it. The correction is minus the deviation. (Taken as the correction itself, which [0118] calls it, it
  doubles the error. [0025-0029] are corrections, if P3 is at -y and n4 points down all the same.)
* The size of the pitch: the angle between the normals of P4. Both texts print P3, whose angle is the yaw's. Then pitch
  and yaw would always be corrected by the same size; and [0109] says that P4 is for the pitch.
* Equal cosines: no correction. The text does not say.
* The threshold is for P2, P3 and P4, the planes that are compared.
* The points of all passes make one plane, since the text has one plane for each sensor. It knows one passage only.
* The result: the three added corrections, as a rotation vector (calibration.json needs a rotation, and I + Ω is none).

Limits. To first order, in a straight pass, each ping lies in a plane across the track, and a wrong angle moves it there
along the track or turns it within. The normals of P1 and P3 turn about z by γ/2 only, that of P2 not at all. The full
angles are

    θ2² = β² + φ²,    θ3² = γ²/4 + (α + β)²/2,    θ4² = α² + β²,

with φ the turn of P2's normal about z, which no mount angle takes away (noise; a wrong lever arm where the heading
swings; the stretch of I + Ω). A step takes β to β - sgn(β) θ2, γ to γ - sgn(γ) θ3 and α to α - sgn(α - β) θ4: pitch
takes its sign from α - β, not from α. If φ = 0, roll is right after one step, pitch after two, and then each step
halves the yaw's error: it converges. If not, β' = β - sgn(β) √(β² + φ²) does not settle: its cycle of two steps, β =
±φ/√3, attracts (slope -1/2). With it pitch changes between ∓φ/3, and yaw between ±φ (√3 - 1)/√67.5. The angle between
the normals of P2 stays at 2φ/√3. A threshold below is not met, and the result depends on whether the last step was odd
or even. (Below φ it is never met; between the two only by a mount that happens to be nearly right before the first
step.)

I + Ω = Exp(δ) + (t² I - δ δᵀ)/2 to second order, t the length of δ. So it stretches the soundings' cloud across δ by
t²/2: 1.5e-4 at 1°, a millimetre at 6 m. On P3 in a straight pass the stretch S looks like the yaw S_xy - S_xx, at most
3 t²/4 (0.013° at 1°): the iteration ends with a yaw that is wrong by so much, and P1 stays turned.

Several passes: a wrong yaw γ moves the points of a pass at distance d by γ d along the track, so that passes at
distances of the variance σ_d² make layers of P3. With the variance σ_s² of the points along the face, the plane through
the layers is turned by γ² σ_d² / (2 σ_s²), whatever the sign of γ. Where this exceeds γ/2 and has the opposite sign,
the rule gives the wrong sign, and the iteration runs away. Shifts of the passes by the INS's drift do the same.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import DegenerateGeometryError
from pipeline.maths.geometry.planes import angle_between
from pipeline.maths.patent.angles import AXES, angles_between, patent_cosines
from pipeline.maths.patent.literal_planes import SessionPlanes

Array = NDArray[np.float64]
COMPARED = {"pitch": "P4", "roll": "P2", "yaw": "P3"}  # planes whose normals give the angle of each step
LARGEST = np.pi / 2  # of a correction: [0023] has all cosines between normals positive
SIGNS = {"pitch": -1.0, "roll": 1.0, "yaw": 1.0}  # of the deviation where the MBES's cosine is the larger [0113-0117]


def literal_deviations(mbes: Mapping[str, Array], laser: Mapping[str, Array]) -> Array:
    """Return the deviations (pitch, roll, yaw) (3,) rad: full angles with the signs of the two cosines [0113-0117].

    Parameters
    ----------
    mbes, laser
        Unit normals (3,) of P1 to P4 in the target frame, by name.
    """
    cosines = patent_cosines(mbes, laser)
    return np.array(
        [
            SIGNS[axis]
            * np.sign(cosines[f"cosine_{axis}_mbes"] - cosines[f"cosine_{axis}_laser"])
            * angle_between(mbes[COMPARED[axis]], laser[COMPARED[axis]])
            for axis in AXES
        ]
    )


@dataclass(frozen=True)
class LiteralAngles:
    """Added corrections (3,) rad about the body's x, y, z (NaN, and the reason, without a result); all steps' rows."""

    angles_rad: Array
    converged: bool
    iterations: int
    reason: str = ""
    rows: list[dict[str, float]] = field(default_factory=list)


def iterate_literally(
    planes: SessionPlanes, lever_arm_m: Array, max_iterations: int, threshold_rad: float
) -> LiteralAngles:
    """Take the printed steps until the angles between the normals of P2, P3 and P4 are below the threshold [0123].

    Not converging is a result, with the corrections of the last step. There is none if the iteration runs away: if a
    correction exceeds 90°, beyond what [0023] presupposes, or if the soundings no longer span a plane.

    Parameters
    ----------
    planes
        Points of both sensors.
    lever_arm_m
        Coarse lever arm (3,), body axes; it is not changed [0122].
    max_iterations
        Largest number of steps.
    threshold_rad
        The patent's threshold, "determined by the circumstances".
    """
    laser, angles_rad = planes.laser_normals, np.zeros(3)
    rows: list[dict[str, float]] = []
    for iteration in range(max_iterations + 1):
        try:
            mbes = planes.mbes_normals(_not_ran_away(angles_rad), lever_arm_m)
        except DegenerateGeometryError as error:
            reason = f"the angles ran away: after step {iteration} {error}" if iteration else str(error)
            return LiteralAngles(np.full(3, np.nan), False, iteration, reason, rows)
        deviations = literal_deviations(mbes, laser)
        between = angles_between(mbes, laser)
        rows.append(
            {"iteration": iteration}
            | {f"deviation_{axis}_deg": float(np.degrees(deviations[k])) for k, axis in enumerate(AXES)}
            | patent_cosines(mbes, laser)
            | {f"angle_{name}_deg": float(np.degrees(angle)) for name, angle in between.items()}
            | {f"rotation_{axis}_deg": float(np.degrees(angles_rad[k])) for k, axis in enumerate("xyz")}
        )
        if all(between[name] < threshold_rad for name in COMPARED.values()):
            return LiteralAngles(angles_rad, True, iteration, rows=rows)
        if iteration < max_iterations:
            angles_rad = angles_rad - deviations
    return LiteralAngles(angles_rad, False, max_iterations, rows=rows)


def _not_ran_away(angles_rad: Array) -> Array:
    largest = float(np.max(np.abs(angles_rad)))
    if largest > LARGEST:
        raise DegenerateGeometryError(f"a correction is {np.degrees(largest):.0f}°")
    return angles_rad
