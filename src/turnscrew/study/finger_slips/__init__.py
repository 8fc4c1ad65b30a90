"""Fingers that slip over the handle: noticed how soon, stopped how soon, and false alarms of them."""
