"""The world as pure functions: layout, frame, edits, sensors, actuators, rules, scenes. No process, no message."""
