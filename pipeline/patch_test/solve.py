"""The patch test: pieces of the bottom and the sonar's mount, adjusted together, each time with the pieces found anew.

Every piece is a plane of its own, of which nothing is known, as the boat saw it from passes both ways or at different
distances. The model is that of a calibration (:mod:`pipeline.adjustment.observation_model`) without the laser. So the
INS's drift, the sonar's small errors and all covariances are the calibration's, too. The coarse mount joins in as what
is known beforehand: its angles by 3°, its lever arm as surveyed. An angle of which the passes tell nothing keeps that
value and that sigma, instead of making the equations singular. The angles of the result are those that belong to the
lever arm as it is known (:mod:`pipeline.patch_test.held_arm`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.adjustment.consider import known_parameters, sonar_errors
from pipeline.adjustment.ins_drift import drift_figures_table
from pipeline.adjustment.iteration import adjust_mount
from pipeline.adjustment.observation_model import ObservationModel
from pipeline.adjustment.problem import CalibrationProblem, PriorInformation, sensor_sigmas
from pipeline.artefacts.streams import Mapper, MemoryPart, Stream
from pipeline.artefacts.to_tables import xyz_columns
from pipeline.config.mount import Mount
from pipeline.config.pool import Adjust, AsBuilt, Ingest
from pipeline.config.session import Laser, Mbes, SessionConfig
from pipeline.maths.adjustment.body_motion import BodyMotion
from pipeline.maths.adjustment.face_shifts import Faces
from pipeline.maths.adjustment.observed_surface import ObservedSurface
from pipeline.maths.adjustment.parameters import State
from pipeline.maths.adjustment.pseudo_observations import ParameterPrior
from pipeline.maths.geometry.rotations import log_so3
from pipeline.maths.mount_parameters import N_MOUNT
from pipeline.mount import Mounted, mount_of
from pipeline.patch_test.bottom_seen import BottomSeen, bottom_seen, squares_of
from pipeline.patch_test.coarse_angles import COARSE_DEG, angles_near
from pipeline.patch_test.contradictions import contradictions
from pipeline.patch_test.held_arm import with_arm_held
from pipeline.patch_test.passes import PatchPasses
from pipeline.report.drift_check import figures_disagree

Array = NDArray[np.float64]
LEVER_M = 0.02  # standard deviation of a surveyed lever arm without a covariance
SEEN = 0.1  # of what was known beforehand: an angle with a smaller sigma is seen, to 0.3°
ROUNDS, CHOSEN = 8, 3  # of finding pieces and adjusting; from this one on no square joins in
FEWEST, DIFFERING = 3, 1 / 3  # pieces; largest share of flat squares on which the passes differ by too much
UNEXPLAINED = 1.5  # a larger variance factor of what passes disagree by is not explained
STILL = 0.5  # of a sigma: a smaller step ends the rounds


@dataclass(frozen=True)
class PatchTest:
    """What the passes say: the mount with the lever arm as known, its total covariance (6, 6), that known beforehand.

    seen: the bottom, as it was used; passes: how many saw a piece that was used, of those sailed; with_cast: whether a
    cast bent the rays; factor: variance factor of what passes and pieces disagree by; settled: whether the mount stays
    when the pieces are found anew; contradicted: what of session.yaml is wrong, in words; drift: what is said of the
    INS's drift, "" for nothing.
    """

    mount: Mounted
    covariance: Array
    known: Array
    seen: BottomSeen
    passes: int
    sailed: int
    with_cast: bool
    factor: float
    settled: bool
    contradicted: Sequence[str]
    drift: str

    @property
    def doubtful(self) -> bool:
        """Whether something is wrong that the sigmas do not explain."""
        disagree = self.factor > UNEXPLAINED or self.seen.differing > DIFFERING
        return bool(self.contradicted) or disagree or not self.settled or len(self.seen.pieces) < FEWEST

    def sees(self, key: str) -> bool:
        """Return whether the passes tell of an angle, by its key in session.yaml."""
        before, after = (self.mount.sigmas(one)[key] for one in (self.known, self.covariance))
        return after < SEEN * before


@dataclass(frozen=True)
class HeadBefore:
    """What is known of a head beforehand: its coarse mount, the covariance of it (6, 6), rad and m, and its settings.

    laser: for the list of a session's errors; the passes meet none of the laser's.
    """

    coarse: Mounted
    known: Array
    laser: Laser
    mbes: Mbes

    @classmethod
    def of(cls, session: SessionConfig, mbes: Mbes) -> "HeadBefore":
        """Return what session.yaml says: the lever arm's covariance, if it was surveyed."""
        known = np.diag([np.radians(COARSE_DEG) ** 2] * 3 + [LEVER_M**2] * 3)
        if mbes.mount_covariance is not None:
            known[3:, 3:] = np.array(mbes.mount_covariance)[3:, 3:]
        return cls(mount_of(mbes.mount), known, session.laser, mbes)

    def with_lever_arm(self, mount: Mapping[str, float], covariance: Array) -> "HeadBefore":
        """Return the same from the mount of a calibration, whose lever arm has a covariance (3, 3)."""
        known = self.known.copy()
        known[3:, 3:] = covariance
        return replace(self, coarse=mount_of(Mount(**mount)), known=known)


def patch_test(passes: PatchPasses, head: HeadBefore, mapper: Mapper) -> PatchTest:
    """Return what passes over the bottom say of a head's mount.

    Parameters
    ----------
    passes : PatchPasses
        The head's soundings, and the track.
    head : HeadBefore
        What is known of the head beforehand.
    mapper : Mapper
        Spreads work on the memory of this process.

    Raises
    ------
    RawDataError
        No piece of the bottom serves, or the passes would turn the mount too far.
    """
    mount, rounds, settled, among = angles_near(passes, head.coarse), 0, False, None
    squares = squares_of(passes, passes.placed(mount)[1])
    while not settled and rounds < ROUNDS:
        rounds, before = rounds + 1, mount
        seen = bottom_seen(passes, mount, squares, among)
        among = seen.pieces if rounds >= CHOSEN else None
        problem = _problem(seen, passes, mount, head, mapper)
        adjusted = adjust_mount(problem, {"mbes": _labelled(seen, passes)}, Adjust(), Ingest().max_gap_s)
        held = with_arm_held(adjusted, problem, head.coarse.lever_arm_body_m, head.known[3:, 3:])
        mount, sigma = held.mount, np.sqrt(np.diag(held.covariance))[:3]
        settled = bool(np.all(np.abs(_turn(before, mount)) < STILL * sigma))
    drift = figures_disagree(drift_figures_table(passes.noise, adjusted.drift_figures))
    return PatchTest(
        mount=mount,
        covariance=held.covariance + max(adjusted.between.factor - 1.0, 0.0) * held.noise,
        known=head.known,
        seen=seen,
        passes=len(set().union(*(piece.passes for piece in seen.pieces))),
        sailed=len(passes.context.starts_ns),
        with_cast=head.mbes.svp is not None,
        factor=adjusted.between.factor,
        settled=settled and adjusted.converged,
        contradicted=contradictions(problem, adjusted, _known(seen, head), Adjust().test_level),
        drift="" if drift is None else drift.words,
    )


def _labelled(seen: BottomSeen, passes: PatchPasses) -> Stream:
    columns = {"t_ns": np.asarray(passes.columns["t_ns"])[seen.rows], "face": seen.piece}
    columns |= xyz_columns("{}_mbes_m", seen.own_m.T) | {"edge_weight": np.ones(len(seen.rows))}
    return Stream((MemoryPart("mbes", columns),))


def _problem(
    seen: BottomSeen, passes: PatchPasses, mount: Mounted, head: HeadBefore, mapper: Mapper
) -> CalibrationProblem:
    """Return the problem of the soundings on the pieces, which starts from a mount."""
    surfaces = _surfaces(seen)
    names, numbers = tuple(surface.family for surface in surfaces), np.arange(len(surfaces))
    lowest_m = min(float(piece.corners_m[:, 2].min()) for piece in seen.pieces)
    model = ObservationModel(
        body=BodyMotion.of(passes.context.trajectory, np.zeros(3)),
        faces=Faces(names, numbers, np.ones(len(surfaces))),
        height_of_face=np.zeros(len(surfaces)),
        coarse=State.at(mount.R_body_from_sensor, mount.lever_arm_body_m, surfaces),
        sigmas={"mbes": sensor_sigmas(head.mbes)},
        wet_heights_m=(lowest_m, passes.level_m),
    )
    coarse = _known(seen, head)
    natural = AsBuilt(offset_sigma_m=0.0, angle_sigma_deg=0.0, bow_sigma_m=0.0)  # a piece is what it is
    depth_m, heads = passes.level_m - lowest_m, {"mbes": head.mbes}
    errors = sonar_errors(coarse.names, head.laser, heads, natural, dict.fromkeys(names, 1.0), depth_m)
    prior = ParameterPrior(np.arange(N_MOUNT), head.known, coarse)
    others = known_parameters(coarse, errors, ())
    prior = prior if others is None else prior.with_independent(others)
    beforehand = PriorInformation(passes.noise, drift=passes.drift, parameters=prior, from_start=True)
    return CalibrationProblem(model, beforehand, errors, mapper)


def _surfaces(seen: BottomSeen) -> tuple[ObservedSurface, ...]:
    return tuple(
        ObservedSurface.at(f"bottom-{k}", piece.normal, piece.corners_m.mean(axis=0))
        for k, piece in enumerate(seen.pieces, start=1)
    )


def _known(seen: BottomSeen, head: HeadBefore) -> State:
    """Return the state with all that is known beforehand."""
    return State.at(head.coarse.R_body_from_sensor, head.coarse.lever_arm_body_m, _surfaces(seen))


def _turn(before: Mounted, after: Mounted) -> Array:
    """Return the rotation vector (3,) rad, body axes, from one mount to another."""
    return log_so3(after.R_body_from_sensor @ before.R_body_from_sensor.T)
