"""Slips of the tip, and false alarms of them."""
