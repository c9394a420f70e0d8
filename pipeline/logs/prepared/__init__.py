"""Logs on one grid and bandwidth, in parts for training, validation and test."""
