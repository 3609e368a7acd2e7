"""Formats for training: YOLO, COCO panoptic, MOT, semantic PNG, HDF5; and splits into training and validation sets."""
