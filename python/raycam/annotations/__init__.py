"""Annotations of images: labels, keypoints, optical flow and disparity."""
