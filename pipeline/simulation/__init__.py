"""Pool sessions with known truth, written as real instrument files.

The forward model is independent. It is written from the conventions (frames, signs, units) only, and does not import
``pipeline.maths`` or ``pipeline.readers``. Therefore a wrong sign in these packages cannot cancel itself.

scenario        the settings of a session (YAML, strict), with scenario_surroundings and scenario_sensors
site            target frame <-> WGS 84, by pyproj
motion          the vessel's true movement
mesh            target and pool as triangles
relief          how the faces as built stand off the mesh's planes
raycast         where a ray meets the mesh
random_streams  one random generator for each purpose
mounts          sensors on the body, and the coarse mount's errors
ins, laser, mbes  the records of each instrument
beams           recorded angles of a fan, and beams of finite width
water_column    beams that bend because the sound speed changes with depth
echoes          which echo a beam detects, and how well
georeferenced   laser points placed in ECEF, as other programs deliver them
novatel, sbet, las, r2sonic_packets (and its XTF shell), tables  the bytes of the instrument files
documents       session.yaml, pool.yaml, truth
session         everything together, in memory and as a folder
"""
