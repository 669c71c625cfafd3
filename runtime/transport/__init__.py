"""Sessions of the simulation and radio planes, their certificates and admission. The one place with Zenoh."""
