"""YARP without YARP: its wire, ports and name server."""
