"""Every Python reads this at its start when `--slow-start` puts this folder on its path: the machine seems slow."""

import os
import time

time.sleep(float(os.environ["FOOSIM_TEST_SLOW_START_S"]))
