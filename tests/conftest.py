"""Settings of all tests."""

from __future__ import annotations

from hypothesis import settings

# the first call of a compiled function translates it, which takes seconds and says nothing of how long an example takes
settings.register_profile("turnscrew", deadline=None)
settings.load_profile("turnscrew")
