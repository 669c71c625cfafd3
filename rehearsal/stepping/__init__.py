"""The world computed tick by tick in one process, and what carries packets between it and those who step it."""
