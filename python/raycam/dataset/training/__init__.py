"""Formats of trainers: YOLO, COCO panoptic, MOT, semantic PNG, HDF5; and splits."""
