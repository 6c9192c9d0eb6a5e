"""Vision: camera frames to poses of fiducial markers relative to the body."""
