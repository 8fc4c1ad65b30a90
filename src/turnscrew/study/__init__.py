"""Questions put to many runs: how well does an estimator, a controller, a gait do, and what does it owe to what."""
