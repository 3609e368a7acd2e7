"""Formats for training, and splits into training and validation sets.

The formats include YOLO, COCO panoptic, MOT, semantic PNG and HDF5.
"""
