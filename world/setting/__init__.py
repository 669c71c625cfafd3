"""What is set while a run goes on: fields of entities, and places."""
