"""Files of point clouds and of calibrations."""
