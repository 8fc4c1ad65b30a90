"""What goes wrong in a run on purpose: sensors that fail, and hands that push.

A run otherwise has nothing acting on its tool but gravity, fingertips and the screw's drive, and sensors with the
errors that its scenario names.  Runs with a disturbance of this package are the only exception; they are made by
studies alone and leave no record that could be taken for a run's.  The loop is the same, to the last line.
"""
