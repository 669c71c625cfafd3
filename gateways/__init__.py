"""Gateways: a run for programs of other protocols, such as the clients of MORSE and YARP."""
