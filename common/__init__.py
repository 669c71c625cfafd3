"""What everything uses: errors, names, limits, units, keyed draws, exact arithmetic. Imports no other package."""
