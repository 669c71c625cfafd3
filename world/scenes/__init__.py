"""Scenes: functions of settings that return scenery, one file each."""
