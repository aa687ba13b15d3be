"""Identification while sailing: windowed output error as an information filter, and a monitor of its predictions."""
