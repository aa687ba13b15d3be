"""MCAP files and ROS 2 bags: CDR, protobuf, JSON and the raw bytes of our own captures."""

from ingest.reader import Reader
from ingest.ros.readers import MCAP, ROSBAG2

READERS: tuple[Reader, ...] = (MCAP, ROSBAG2)
"""Formats of this family."""
