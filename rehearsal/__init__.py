"""The whole system in one process on virtual time, over an in-memory bus; also re-simulation and its commands."""
