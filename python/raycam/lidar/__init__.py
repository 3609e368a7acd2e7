"""Lidars: devices, their calibrations and firing patterns, and scans with ground truth."""

from .device import device_description, device_names
from .files.calibrations import load_lidar
from .lidar import Lidar
from .scan_result import Scan
from .scanning import scan, scan_many

__all__ = ["Lidar", "Scan", "device_description", "device_names", "load_lidar", "scan", "scan_many"]
