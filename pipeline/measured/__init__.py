"""Robots whose electrical power others measured, beside what the model predicts of them."""
