"""The observation model of a run's adjustment, for measurements of parts of it."""

from pathlib import Path

from pipeline.adjustment.ins_drift import drift_prior, pose_noise
from pipeline.adjustment.observation_model import ObservationModel
from pipeline.adjustment.problem import SessionData, sonar_problem, surfaces_of_laser
from pipeline.artefacts.catalogue.points import POSES
from pipeline.artefacts.catalogue.target import PLANES, TARGET_POSE
from pipeline.artefacts.from_tables import trajectory_in_target
from pipeline.mount import mount_of
from pipeline.run.results import Tables
from pipeline.run.settings import read_settings
from pipeline.target.design import target_of


def observation_model(run: Path) -> ObservationModel:
    """Return the model that turns the points of a run into observations; the run calibrates the sonar."""
    tables, settings = Tables(run), read_settings(run)
    pool, session = settings.pool, settings.session
    target, laser, mbes = target_of(pool.target), session.laser, session.mbes
    assert mbes is not None
    data = SessionData(
        target=target,
        surfaces=surfaces_of_laser(target, tables.table(PLANES)),
        trajectory=trajectory_in_target(tables.table(POSES), tables.table(TARGET_POSE)),
        laser_lever_arm_m=mount_of(laser.mount).lever_arm_body_m,
        noise=pose_noise(session.ins.drift, session.ins.white),
        drift=drift_prior(session.ins.drift_within),
        as_built=pool.as_built,
    )
    return sonar_problem(data, mount_of(mbes.mount), {"laser": laser, "mbes": mbes}).model
