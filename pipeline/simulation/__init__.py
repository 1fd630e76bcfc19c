"""Pool sessions with known truth, written as real instrument files.

An independent forward model: it is written from the conventions (frames, signs, units) alone and imports nothing of
``pipeline.maths`` or ``pipeline.readers``, so that a wrong sign there cannot cancel itself here.

scenario    what a session is like (YAML, strict)
earth       target frame <-> WGS 84, by pyproj
motion      the vessel's true movement
mesh        target and pool as triangles;  raycast: what a ray meets
noise       one random generator for each purpose
mounts      sensors on the body, and the coarse mount's errors
ins, laser, mbes      what each instrument records;  beams: of what a fan of beams consists
georeferenced         laser points placed in ECEF, as other programs hand them on
novatel, sbet, las, bth0 (and its XTF shell)      the bytes of its files;  tables: soundings as Parquet
texts       session.yaml, pool.yaml, truth
session     everything together, in memory and as a folder
"""
