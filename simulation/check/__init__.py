"""The laws of components, checked in the rehearsals of a deployment that uses them."""
