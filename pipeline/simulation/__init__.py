"""Pool sessions with known truth, written as real instrument files.

The forward model is independent. It is written from the conventions (frames, signs, units) only, and does not import
``pipeline.maths`` or ``pipeline.readers``. Therefore a wrong sign in these packages cannot cancel itself.

scenario        the settings of a session (YAML, strict), with scenario_surroundings, _ins, _laser, _mbes
site            target frame <-> WGS 84, by pyproj
motion          the vessel's true movement
mesh            target and pool as triangles
face_faults, relief  how the faces as built stand off the mesh's planes
raycast         where a ray meets the mesh
random_streams  one random generator for each purpose
mounts          sensors on the body, and the coarse mount's errors
ins, laser, mbes  the records of each instrument
ins_errors      drift, steps and noise of the INS
beams           recorded angles of a fan, and beams of finite width
water_column    beams that bend because the sound speed changes with depth
echoes, corner_echoes  which echo a beam detects
range_errors    what a sensor adds to a range because of how it meets a face
laser_returns   ranges of laser beams that have a width
georeferenced   laser points placed in ECEF, as other programs deliver them
novatel, sbet, las, r2sonic_packets (and its XTF shell), tables  the bytes of the instrument files
documents       session.yaml, pool.yaml, truth
session         everything together, in memory and as a folder
"""
