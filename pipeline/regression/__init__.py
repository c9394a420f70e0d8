"""Identification of machines with a fixed base from joint torques, by regression."""
