"""The physics of radio and medium access as pure functions: losses, shadowing, fading, errors, airtime and contention.

Nothing here remembers anything but tables, reads a configuration or draws a number: positions, words of keyed draws
(`foosim.common.keyed_random`) and times are arguments. Powers are in dBm, losses and ratios in dB, times in whole
nanoseconds. The stages of the pipeline are its users; the packages beside it are not imported.
"""
