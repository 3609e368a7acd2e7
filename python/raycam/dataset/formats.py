"""The table of data set formats: each format has one row here and one module."""

from __future__ import annotations

from . import bop, coco, colmap, kitti, nerf, nuscenes, photographs, rgbd, semantickitti, web
from .training import hdf5, mcap, mot, panoptic, replicator, semantic, yolo

__all__ = ["FORMATS"]

FORMATS = {
    "coco": coco.FORMAT,
    "bop": bop.FORMAT,
    "kitti": kitti.FORMAT,
    "semantickitti": semantickitti.FORMAT,
    "nuscenes": nuscenes.FORMAT,
    "colmap": colmap.FORMAT,
    "nerf": nerf.FORMAT,
    "tum": rgbd.TUM,
    "scannet": rgbd.SCANNET,
    "webdataset": web.FORMAT,
    "yolo": yolo.FORMAT,
    "panoptic": panoptic.FORMAT,
    "semantic": semantic.FORMAT,
    "mot": mot.FORMAT,
    "hdf5": hdf5.FORMAT,
    "mcap": mcap.FORMAT,
    "replicator": replicator.FORMAT,
    "photos": photographs.FORMAT,
}
"""Formats by name."""
