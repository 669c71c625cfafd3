"""Settings during a run: fields of entities, and places."""
