"""Answers about pictures beside the pictures themselves: labels, optical flow, keypoints."""
