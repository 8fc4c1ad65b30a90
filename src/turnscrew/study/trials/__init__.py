"""Many trials under drawn variations: how often the screw is driven, and why not."""
