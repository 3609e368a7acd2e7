"""Lidars: devices, their calibrations and firing patterns, and scans with ground truth."""

from .device import device_description, device_names
from .files.calibrations import load_lidar
from .lidar import Lidar
from .measured_faces import MeasuredFaces, measured_faces
from .scan_result import Scan
from .scanning import lidar_named, scan, scan_many

__all__ = [
    "Lidar",
    "MeasuredFaces",
    "Scan",
    "device_description",
    "device_names",
    "lidar_named",
    "load_lidar",
    "measured_faces",
    "scan",
    "scan_many",
]
