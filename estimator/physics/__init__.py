"""The driveline: one superset model that holds every effect, of which the nominal model is a special case."""
