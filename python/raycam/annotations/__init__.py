"""Annotations of pictures: labels, keypoints, optical flow and disparity."""
