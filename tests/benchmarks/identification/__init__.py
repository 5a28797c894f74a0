"""How right the identified models are: ``python -m tests.benchmarks.identification`` (see ``__main__``)."""
