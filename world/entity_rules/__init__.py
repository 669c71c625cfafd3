"""Rules of entities: changes of an entity after it was solved, one file each."""
