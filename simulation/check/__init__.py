"""The laws of forms, checked in the rehearsals of a deployment that uses them."""
