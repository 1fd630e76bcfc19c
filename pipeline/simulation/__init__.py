"""Pool sessions with known truth, written as real instrument files.

An independent forward model: it is written from the conventions (frames, signs, units) alone and imports nothing of
``pipeline.maths`` or ``pipeline.readers``, so that a wrong sign there cannot cancel itself here.

scenario    what a session is like (YAML, strict)
earth       target frame <-> WGS 84, by pyproj
motion      the vessel's true movement
mesh        target and pool as triangles;  raycast: what a ray meets
ins, laser, mbes      what each instrument records
novatel, sbet, las, bth0, xtf     the bytes of its files
session     everything together, in memory and as a folder
"""
