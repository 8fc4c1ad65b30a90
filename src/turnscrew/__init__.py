"""A robot hand that drives screws with an ordinary screwdriver held in its fingertips."""

__version__ = "0.1.0"
