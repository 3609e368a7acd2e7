"""Sensors: the protocol that cameras, lidars and other measuring devices implement."""

from .sensor import Sensor, describe_sensor, read_sensor, sample_sensor

__all__ = ["Sensor", "describe_sensor", "read_sensor", "sample_sensor"]
