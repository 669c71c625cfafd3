"""Rules of entities: what an entity does by itself after it was solved, one file each."""
