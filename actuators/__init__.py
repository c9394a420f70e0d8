"""Friction, transmission and motor laws, chains of them, and their energy accounting."""
